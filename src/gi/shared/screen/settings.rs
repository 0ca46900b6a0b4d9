//! What can be set of the stages that all techniques share.

use crate::gi::Settings;
use crate::gi::settings::{Domain, Group, PresetValues, Rule, Setting};
use crate::gi::shared::interleave::Pattern;
use crate::gi::shared::surfaces::Limits;

/// Settings that every technique has.
pub static SETTINGS: &[Setting] = &[
    Setting {
        name: "gather_scale",
        help: "one pixel gathers in each square so wide, and the others take from those around \
               them on their own surface; who finds none gathers too",
        unit: "px",
        domain: Domain::OneOf(&[1, 2, 4]),
        default: "1",
    },
    Setting {
        name: "history",
        help: "frames that the diffuse light of all frames so far weighs at most; 0: each frame \
               stands alone",
        unit: "frames",
        domain: Domain::Count { min: 0, max: 256 },
        default: "0",
    },
    Setting {
        name: "material_test",
        help: "whether light of frames before has to be of the same material",
        unit: "",
        domain: Domain::Choice(&["off", "on"]),
        default: "off",
    },
    Setting {
        name: "relight_tile",
        help: "width of squares of which one pixel gathers again where light may have changed, so \
               that history follows; 0: none does, and history weighs 4 frames while lights move",
        unit: "px",
        domain: Domain::Count { min: 0, max: 16 },
        default: "4",
    },
    Setting {
        name: "relight_slack",
        help: "ε: where light changes by the share λ, history weighs ε/λ − ε frames",
        unit: "",
        domain: Domain::Number {
            min: 0.01,
            max: 4.0,
        },
        default: "0.3",
    },
    Setting {
        name: "blur",
        help: "mean over neighbours on one surface: off, as wide everywhere, narrower where there \
               is more history and where pixels have more directions, or a-trous: as far as light \
               differs by noise alone",
        unit: "",
        domain: Domain::Choice(&["off", "even", "adaptive", "a-trous"]),
        default: "off",
    },
    Setting {
        name: "blur_radius",
        help: "radius of an even blur, and of an adaptive one of up to four directions a pixel",
        unit: "px",
        domain: Domain::Number {
            min: 0.5,
            max: 32.0,
        },
        default: "8",
    },
    Setting {
        name: "blur_levels",
        help: "levels of the à-trous filter, each twice as wide as the one before",
        unit: "",
        domain: Domain::Count { min: 1, max: 5 },
        default: "3",
    },
    Setting {
        name: "blur_contrast",
        help: "neighbours whose luminance differs by so many standard deviations weigh 1/e",
        unit: "",
        domain: Domain::Number {
            min: 0.1,
            max: 100.0,
        },
        default: "4",
    },
    Setting {
        name: "plane_tolerance",
        help: "pixels further than this off a pixel's plane share nothing with it",
        unit: "px",
        domain: Domain::Number {
            min: 0.1,
            max: 16.0,
        },
        default: "0.5",
    },
    Setting {
        name: "normal_cosine",
        help: "pixels whose normals have a smaller cosine share nothing",
        unit: "",
        domain: Domain::Number {
            min: -1.0,
            max: 0.999,
        },
        default: "0.9",
    },
];

/// Values of a preset that gathers along few directions.
pub const FAST: PresetValues = &[("history", "32"), ("blur", "adaptive")];

/// When they have an effect.
pub static RULES: &[Rule] = &[
    Rule::always(Group::Screen, &["gather_scale", "history", "blur"]),
    Rule {
        group: Group::Screen,
        settings: &["relight_tile", "material_test"],
        applies: |settings| settings.count("history") > 0,
    },
    Rule {
        group: Group::Screen,
        settings: &["relight_slack"],
        applies: |settings| settings.count("history") > 0 && settings.count("relight_tile") > 0,
    },
    Rule {
        group: Group::Screen,
        settings: &["blur_radius"],
        applies: |settings| settings.is("blur", "even") || settings.is("blur", "adaptive"),
    },
    Rule {
        group: Group::Screen,
        settings: &["blur_levels", "blur_contrast"],
        applies: |settings| settings.is("blur", "a-trous"),
    },
    Rule {
        group: Group::Screen,
        settings: &["plane_tolerance", "normal_cosine"],
        applies: |settings| {
            settings.count("history") > 0
                || settings.count("gather_scale") > 1
                || !settings.is("blur", "off")
                || (Pattern::new(settings).count() > 1 && has_window(settings))
                || (Pattern::specular(settings).count() > 1 && mirrors(settings))
        },
    },
];

fn has_window(settings: &Settings) -> bool {
    settings.find_choice("interleave_window") != Some("off")
}

fn mirrors(settings: &Settings) -> bool {
    settings.find_choice("specular") != Some("off")
}

/// Which radius a blur has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Blurring {
    /// There is none.
    Off,
    /// The same everywhere.
    Even,
    /// Smaller by the root of the directions that a pixel's light is the mean of.
    Adaptive,
    /// None: neighbours weigh by how much their light differs.
    ATrous,
}

/// How the stages are run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScreenSettings {
    /// Which directions the pixels of a tile take.
    pub pattern: Pattern,
    /// Whether there is a mean over windows as large as a tile.
    pub has_window: bool,
    /// Which directions of a glossy lobe they mirror.
    pub specular_pattern: Pattern,
    /// Whether they gather in parts, each along one direction.
    pub splits: bool,
    /// Width of the squares in each of which a pixel gathers (px).
    pub scale: u32,
    /// What history and a frame weigh at most (frames); 0: there is no history.
    pub longest_history: u32,
    /// Whether history has to be of the same material.
    pub tests_material: bool,
    /// Where light changes, one in so many pixels along each axis that gather tells by how much;
    /// 0: none does.
    pub relight_tile: u32,
    /// ε: where light changes by the share λ, history weighs ε/λ − ε frames.
    pub relight_slack: f32,
    /// Which blur there is.
    pub blur: Blurring,
    /// Its radius (px).
    pub blur_radius: f32,
    /// Levels of an à-trous filter.
    pub blur_levels: u32,
    /// Standard deviations of luminance at which a neighbour weighs 1/e in it.
    pub blur_contrast: f32,
    /// Which pixels share.
    pub limits: Limits,
    /// Directions of a pixel in a frame.
    pub directions: f32,
}

/// Directions of a pixel where a technique has no number of them: so many that a blur is narrow.
const COUNTLESS: f32 = 256.0;

impl ScreenSettings {
    /// As a technique's settings say; `directions` a pixel, where there is a number of them.
    pub fn new(settings: &Settings, directions: Option<u32>) -> Self {
        ScreenSettings {
            pattern: Pattern::new(settings),
            has_window: has_window(settings),
            specular_pattern: if mirrors(settings) {
                Pattern::specular(settings)
            } else {
                Pattern::of([1, 1])
            },
            splits: settings.find_choice("interleave_order") == Some("split"),
            scale: settings.find_count("gather_scale").unwrap_or(1),
            longest_history: settings.find_count("history").unwrap_or(0),
            tests_material: settings.find_choice("material_test") == Some("on"),
            relight_tile: settings.find_count("relight_tile").unwrap_or(0),
            relight_slack: settings.find_number("relight_slack").unwrap_or(0.0),
            blur: match settings.find_choice("blur") {
                Some("even") => Blurring::Even,
                Some("adaptive") => Blurring::Adaptive,
                Some("a-trous") => Blurring::ATrous,
                _ => Blurring::Off,
            },
            blur_radius: settings.find_number("blur_radius").unwrap_or(0.0),
            blur_levels: settings.find_count("blur_levels").unwrap_or(0),
            blur_contrast: settings.find_number("blur_contrast").unwrap_or(0.0),
            limits: Limits::new(settings),
            directions: directions.map_or(COUNTLESS, |count| count as f32),
        }
    }

    /// Whether pixels of a tile gather along different directions and share nothing.
    pub fn shows_patterns(&self) -> bool {
        self.pattern.count() > 1
            && !self.has_window
            && self.longest_history == 0
            && self.blur == Blurring::Off
    }

    /// Frames until a picture of what stands still is as it stays: half of what history may weigh
    /// is there.
    pub fn frames_to_rest(&self) -> u32 {
        (self.longest_history / 2).max(1)
    }
}
