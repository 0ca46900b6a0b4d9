//! Faults to plant, for tests: what devices and drivers rarely do, at a moment that the test
//! chooses. Without any, nothing is done.

use std::fmt::Display;
use std::str::FromStr;
use std::sync::{Mutex, MutexGuard, PoisonError};

use ash::vk;

/// What goes wrong, and when. Events are counted from 0, from the moment when the faults are
/// planted.
#[doc(hidden)]
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Faults {
    /// The allocation that finds no memory.
    pub allocation: Option<u64>,
    /// The submission with which the device is lost for good, and the number of its steps that
    /// finish before.
    pub loss: Option<(u64, usize)>,
    /// The picture of the window that is not shown, and what the driver says.
    pub present: Option<(u64, vk::Result)>,
    /// Features that the device is said to lack, by their names in `lumivox devices`.
    pub absent: Vec<String>,
    /// Sizes are limited to what every device of Vulkan 1.3 allows.
    pub least_limits: bool,
}

/// The faults of one device, and what it has counted so far.
#[derive(Default)]
pub(super) struct Planted(Mutex<Counts>);

#[derive(Default)]
struct Counts {
    faults: Faults,
    allocations: u64,
    submissions: u64,
    #[cfg_attr(
        not(feature = "view"),
        allow(dead_code, reason = "only windows present")
    )]
    presents: u64,
}

impl Planted {
    pub(super) fn new(faults: Faults) -> Self {
        let planted = Planted::default();
        planted.plant(faults);
        planted
    }

    /// Takes other faults, and counts from 0 again; answers how many allocations there were since
    /// the last time.
    pub(super) fn plant(&self, faults: Faults) -> u64 {
        std::mem::replace(
            &mut *self.counts(),
            Counts {
                faults,
                ..Counts::default()
            },
        )
        .allocations
    }

    /// Whether the allocation that begins here fails.
    pub(super) fn fails_allocation(&self) -> bool {
        let mut counts = self.counts();
        counts.allocations += 1;
        counts
            .faults
            .allocation
            .is_some_and(|index| index + 1 == counts.allocations)
    }

    /// How many steps of the submission that begins here finish before the device is lost; `None`
    /// where it is not.
    pub(super) fn loss(&self) -> Option<usize> {
        let mut counts = self.counts();
        counts.submissions += 1;
        let (index, steps) = counts
            .faults
            .loss
            .filter(|(index, _)| *index < counts.submissions)?;
        Some(if index + 1 == counts.submissions {
            steps
        } else {
            0
        })
    }

    /// The result that the driver is made to return for the picture that is shown here.
    #[cfg_attr(
        not(feature = "view"),
        allow(dead_code, reason = "only windows present")
    )]
    pub(super) fn present(&self) -> Option<vk::Result> {
        let mut counts = self.counts();
        counts.presents += 1;
        counts
            .faults
            .present
            .filter(|(index, _)| index + 1 == counts.presents)
            .map(|(_, result)| result)
    }

    fn counts(&self) -> MutexGuard<'_, Counts> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl FromStr for Faults {
    type Err = String;

    /// `allocation=N`, `loss=N:STEPS`, `surface-lost=N`, `out-of-date=N`, `absent=FEATURE` and
    /// `limits=least`, separated by spaces.
    fn from_str(text: &str) -> Result<Self, String> {
        let mut faults = Faults::default();
        for word in text.split_whitespace() {
            let wrong = |why: &dyn Display| format!("{word} is no fault: {why}");
            let count = |text: &str| text.parse::<u64>().map_err(|error| wrong(&error));
            match word.split_once('=') {
                Some(("allocation", index)) => faults.allocation = Some(count(index)?),
                Some(("loss", at)) => {
                    let (index, steps) = at
                        .split_once(':')
                        .ok_or_else(|| wrong(&"write loss=N:STEPS"))?;
                    faults.loss =
                        Some((count(index)?, steps.parse().map_err(|error| wrong(&error))?));
                }
                Some(("surface-lost", index)) => {
                    faults.present = Some((count(index)?, vk::Result::ERROR_SURFACE_LOST_KHR))
                }
                Some(("out-of-date", index)) => {
                    faults.present = Some((count(index)?, vk::Result::ERROR_OUT_OF_DATE_KHR))
                }
                Some(("absent", feature)) => faults.absent.push(feature.to_owned()),
                Some(("limits", "least")) => faults.least_limits = true,
                _ => {
                    return Err(wrong(
                        &"write allocation=N, loss=N:STEPS, surface-lost=N, out-of-date=N, \
                          absent=FEATURE or limits=least",
                    ));
                }
            }
        }
        Ok(faults)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn events_are_counted_from_0() {
        let planted = Planted::new(Faults {
            allocation: Some(1),
            loss: Some((1, 5)),
            ..Faults::default()
        });
        assert_eq!(
            [(); 3].map(|()| planted.fails_allocation()),
            [false, true, false]
        );
        assert_eq!([(); 3].map(|()| planted.loss()), [None, Some(5), Some(0)]);
        assert_eq!(
            planted.plant(Faults {
                present: Some((0, vk::Result::ERROR_OUT_OF_DATE_KHR)),
                ..Faults::default()
            }),
            3
        );
        assert_eq!(
            [(); 2].map(|()| planted.present()),
            [Some(vk::Result::ERROR_OUT_OF_DATE_KHR), None]
        );
        assert!(!planted.fails_allocation() && planted.loss().is_none());
    }

    #[test]
    fn words_are_faults_or_told() {
        let surface = (2, vk::Result::ERROR_SURFACE_LOST_KHR);
        let faults = Faults {
            allocation: Some(3),
            loss: Some((4, 2)),
            present: Some(surface),
            absent: vec!["geometryShader".into()],
            least_limits: true,
        };
        assert_eq!(
            "allocation=3 loss=4:2 surface-lost=2 absent=geometryShader limits=least".parse(),
            Ok(faults)
        );
        assert_eq!("".parse(), Ok(Faults::default()));
        for (text, says) in [
            ("allocation=-1", "allocation=-1"),
            ("loss=4", "loss=N:STEPS"),
            ("nonsense", "absent=FEATURE"),
        ] {
            assert!(
                matches!(text.parse::<Faults>(), Err(error) if error.contains(says)),
                "{text}"
            );
        }
    }
}
