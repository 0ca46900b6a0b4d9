//! What drivers do that Vulkan does not say, and that passes have to know.

use ash::vk;

/// How loops of shaders run on a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Loops {
    /// Turns after which the driver ends the loops of an invocation, without a word; `None` where
    /// it never does.
    pub limit: Option<u32>,
    /// Turns that an invocation is given in one dispatch, at most: work with more of them is split.
    pub budget: u32,
    /// Invocations that go through a loop together: it turns for all of them until the last has
    /// ended.
    pub lanes: u32,
}

impl Loops {
    /// Of a driver that only watches how long work takes. Some 40 rays of each pixel through 256³
    /// voxels are one dispatch then: at 1920×1080 and 0.3·10⁹ rays/s, 0.3 s.
    pub const WATCHED: Loops = Loops {
        limit: None,
        budget: 1 << 16,
        lanes: 1,
    };

    /// Of Mesa's llvmpipe, which lavapipe runs shaders on. It ends loops after 65,535 turns
    /// (`LP_MAX_TGSI_LOOP_ITERATIONS`), and its vectors have up to eight lanes, which a loop turns
    /// for until the last has ended.
    pub const LLVMPIPE: Loops = Loops {
        limit: Some(65_535),
        budget: 65_535,
        lanes: 8,
    };

    /// What is known of a driver.
    pub(super) fn of(driver: vk::DriverId) -> Self {
        match driver {
            vk::DriverId::MESA_LLVMPIPE => Loops::LLVMPIPE,
            _ => Loops::WATCHED,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_llvmpipe_ends_loops() {
        assert_eq!(Loops::of(vk::DriverId::MESA_LLVMPIPE), Loops::LLVMPIPE);
        for driver in [
            vk::DriverId::MESA_RADV,
            vk::DriverId::NVIDIA_PROPRIETARY,
            vk::DriverId::GOOGLE_SWIFTSHADER,
        ] {
            assert_eq!(Loops::of(driver).limit, None);
        }
    }
}
