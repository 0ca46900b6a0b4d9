//! How often light goes from place to place of a store.

use crate::gi::Settings;

/// How many indirect bounces there are, the one to the pixel among them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LightBounces {
    /// So many in each frame, at least 1.
    Count(u32),
    /// One more with each frame, from what the last one left.
    Feedback,
}

impl LightBounces {
    /// From a technique's settings.
    pub fn new(settings: &Settings) -> Self {
        settings
            .choice("bounces")
            .parse()
            .map_or(LightBounces::Feedback, LightBounces::Count)
    }

    /// How many; `None` where it is all of them, after some frames.
    pub fn count(self) -> Option<u32> {
        match self {
            LightBounces::Count(count) => Some(count),
            LightBounces::Feedback => None,
        }
    }

    /// Frames until the light is complete. Where surfaces reflect three quarters, feedback has all
    /// but (3/4)^16, 1%, of its light then.
    pub fn frames_to_rest(self) -> u32 {
        match self {
            LightBounces::Count(_) => 1,
            LightBounces::Feedback => 17,
        }
    }

    /// How often places gather in one frame before their light is complete.
    pub fn before_the_picture(self) -> u32 {
        self.count().map_or(0, |count| count - 1)
    }

    /// Whether they gather at all.
    pub fn any(self) -> bool {
        self != LightBounces::Count(1)
    }
}
