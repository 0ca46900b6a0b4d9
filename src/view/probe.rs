//! The probe: one cone from what is under a place of the picture, with its samples.

use std::fmt::Write as _;

use crate::frame::Traced;
use crate::gi::{TraceAxis, TracedCone};

/// A cone that is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ProbeJob {
    /// The job of the picture that it begins in, which is there in full.
    pub(super) job: u64,
    /// 0 left, 1 right.
    pub(super) pane: usize,
    pub(super) pixel: [u32; 2],
    pub(super) axis: TraceAxis,
    /// γ in place of the technique's own (degrees).
    pub(super) aperture_deg: Option<f32>,
}

/// What came back.
pub(super) struct ProbeAnswer {
    pub(super) of: ProbeJob,
    pub(super) found: Result<Traced, String>,
}

/// Which cone is wanted, and what came back last.
pub(super) struct ProbeState {
    /// Shares of the picture; `None` while there is no probe.
    pub(super) place: Option<[f32; 2]>,
    /// Whether the place is that of the pointer.
    pub(super) follows: bool,
    pub(super) axis: TraceAxis,
    pub(super) aperture_deg: Option<f32>,
    /// Whether samples of empty space are listed.
    pub(super) lists_empty: bool,
    pub(super) answer: Option<ProbeAnswer>,
    pub(super) asked: Option<ProbeJob>,
}

impl Default for ProbeState {
    fn default() -> Self {
        ProbeState {
            place: None,
            follows: false,
            axis: TraceAxis::Normal,
            aperture_deg: None,
            lists_empty: true,
            answer: None,
            asked: None,
        }
    }
}

impl ProbeState {
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
pub(super) fn table(probe: &TracedCone) -> String {
    let header = "distance_m,diameter_m,level,radiance_r,radiance_g,radiance_b,opacity,covered,\
                  gathered_r,gathered_g,gathered_b\n";
    let mut text = header.to_owned();
    for sample in &probe.samples {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_probe_comes_moves_and_goes() {
        let mut state = ProbeState::default();
        state.toggle(None);
        assert_eq!(state.place, Some([0.5; 2]));
        state.toggle(Some([0.2, 0.3]));
        assert_eq!(state.place, Some([0.2, 0.3]));
        state.toggle(None);
        assert_eq!(state.place, None);
    }
}
