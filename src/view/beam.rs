//! One beam of the gather, from what is under a place of the picture, with its samples.

use std::fmt::Write as _;

use crate::frame::Traced;
use crate::gi::inspect::{Beam, BeamAxis};

/// A beam that is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct BeamJob {
    /// The job of the picture that it begins in, which is there in full.
    pub(super) job: u64,
    /// 0 left, 1 right.
    pub(super) pane: usize,
    pub(super) pixel: [u32; 2],
    pub(super) axis: BeamAxis,
    /// γ in place of the technique's own (degrees).
    pub(super) aperture_deg: Option<f32>,
}

/// What came back.
pub(super) struct BeamAnswer {
    pub(super) of: BeamJob,
    pub(super) found: Result<Traced, String>,
}

/// Which beam is wanted, and what came back last.
pub(super) struct BeamState {
    /// Shares of the picture; `None` while there is no beam.
    pub(super) place: Option<[f32; 2]>,
    /// Whether the beam follows the pointer.
    pub(super) follows: bool,
    pub(super) axis: BeamAxis,
    pub(super) aperture_deg: Option<f32>,
    /// Whether samples of empty space are listed.
    pub(super) lists_empty: bool,
    pub(super) answer: Option<BeamAnswer>,
    pub(super) asked: Option<BeamJob>,
}

impl Default for BeamState {
    fn default() -> Self {
        BeamState {
            place: None,
            follows: false,
            axis: BeamAxis::Normal,
            aperture_deg: None,
            lists_empty: true,
            answer: None,
            asked: None,
        }
    }
}

impl BeamState {
    /// Puts it where the pointer is, or in the middle, or takes it away.
    pub(super) fn toggle(&mut self, pointer: Option<[f32; 2]>) {
        self.place = match (pointer, self.place) {
            (Some(pointer), _) => Some(pointer),
            (None, Some(_)) => None,
            (None, None) => Some([0.5; 2]),
        };
        self.follows = false;
    }
}

/// The samples as CSV.
pub(super) fn table(beam: &Beam) -> String {
    let header = "distance_m,diameter_m,level,radiance_r,radiance_g,radiance_b,opacity,covered,\
                  gathered_r,gathered_g,gathered_b\n";
    let mut text = header.to_owned();
    for sample in &beam.samples {
        let ([r, g, b], [x, y, z]) = (sample.radiance.to_array(), sample.gathered.to_array());
        let (distance, diameter, level) = (sample.distance_m, sample.diameter_m, sample.level);
        // Writing to a string does not fail.
        let _ = writeln!(
            text,
            "{distance},{diameter},{level},{r},{g},{b},{},{},{x},{y},{z}",
            sample.opacity, sample.covered
        );
    }
    text
}

/// Figures as CSV: a name and a quoted value a line.
pub(super) fn figure_table(figures: &[(&'static str, String)]) -> String {
    let lines = figures
        .iter()
        .map(|(name, value)| format!("{name},\"{value}\"\n"));
    std::iter::once(String::from("name,value\n"))
        .chain(lines)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_beam_comes_moves_and_goes() {
        let mut state = BeamState::default();
        state.toggle(None);
        assert_eq!(state.place, Some([0.5; 2]));
        state.toggle(Some([0.2, 0.3]));
        assert_eq!(state.place, Some([0.2, 0.3]));
        state.toggle(None);
        assert_eq!(state.place, None);
    }
}
