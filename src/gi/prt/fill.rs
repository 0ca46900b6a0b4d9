//! Points that have no light of their own: those inside of something, and those that hang on an
//! edge.

use std::collections::VecDeque;

use rayon::prelude::*;

use super::lattice::Hanging;

/// Gives points that hang on an edge what the coarser triangle has there.
pub(super) fn hang(rows: &mut [f32], stride: usize, hanging: &[Hanging]) {
    for own in hanging {
        for at in 0..stride {
            let of = |point: u32| rows[point as usize * stride + at];
            let [a, b] = own.between.map(of);
            rows[own.point as usize * stride + at] = a + own.share * (b - a);
        }
    }
}

/// Which points are not inside of something. Of those in doubt it is those that `reach` others
/// which are not, where it is known of some that they are not; found step by step, since what is
/// reached may have been in doubt as well.
pub(super) fn open_points(
    is_doubtful: impl Iterator<Item = bool>,
    reaches: impl Fn(usize, &[bool]) -> bool + Sync,
) -> Vec<bool> {
    let mut is_open: Vec<bool> = is_doubtful.map(|is_doubtful| !is_doubtful).collect();
    loop {
        let found: Vec<usize> = (0..is_open.len())
            .into_par_iter()
            .filter(|point| !is_open[*point] && reaches(*point, &is_open))
            .collect();
        if found.is_empty() {
            return is_open;
        }
        found.iter().for_each(|point| is_open[*point] = true);
    }
}

/// For each point a valid one: itself, or one of the nearest along the lattice. Those that no valid
/// one is near stand for themselves.
pub(super) fn stand_ins(is_valid: &[bool], neighbours: &[Vec<u32>]) -> Vec<u32> {
    let mut found: Vec<u32> = (0..is_valid.len() as u32).collect();
    let mut is_known = is_valid.to_vec();
    let mut queue: VecDeque<u32> = found.clone().into();
    queue.retain(|point| is_valid[*point as usize]);
    while let Some(point) = queue.pop_front() {
        for other in &neighbours[point as usize] {
            if !std::mem::replace(&mut is_known[*other as usize], true) {
                found[*other as usize] = found[point as usize];
                queue.push_back(*other);
            }
        }
    }
    found
}

/// Gives points that are not valid the mean of their neighbours, ring by ring; returns how many.
/// Those that no valid one is near keep what they have.
pub(super) fn fill(
    rows: &mut [f32],
    stride: usize,
    is_valid: &[bool],
    neighbours: &[Vec<u32>],
) -> u32 {
    let mut is_known = is_valid.to_vec();
    let beside = |known: &[u32], is_known: &[bool]| {
        let near = known.iter().flat_map(|point| &neighbours[*point as usize]);
        let mut ring: Vec<u32> = near
            .copied()
            .filter(|point| !is_known[*point as usize])
            .collect();
        ring.sort_unstable();
        ring.dedup();
        ring
    };
    let valid: Vec<u32> = (0..is_valid.len() as u32)
        .filter(|point| is_valid[*point as usize])
        .collect();
    let mut ring = beside(&valid, &is_known);
    let mut count = 0;
    while !ring.is_empty() {
        let mean = |point: &u32| {
            let known =
                (neighbours[*point as usize].iter()).filter(|other| is_known[**other as usize]);
            let (mut sum, mut all) = (vec![0.0f32; stride], 0.0);
            for other in known {
                let other = &rows[*other as usize * stride..][..stride];
                sum.iter_mut().zip(other).for_each(|(sum, own)| *sum += own);
                all += 1.0;
            }
            sum.iter_mut().for_each(|sum| *sum /= all);
            sum
        };
        let means: Vec<Vec<f32>> = ring.iter().map(mean).collect();
        for (point, mean) in ring.iter().zip(means) {
            rows[*point as usize * stride..][..stride].copy_from_slice(&mean);
            is_known[*point as usize] = true;
        }
        count += ring.len() as u32;
        ring = beside(&ring, &is_known);
    }
    count
}
