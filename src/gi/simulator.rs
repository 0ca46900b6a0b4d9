//! A method on the CPU, to be watched: a simulator carries it out action by action, tells figures
//! and draws what it has so far. The window has a panel for the one of a technique.

use super::settings::{Rule, Setting, SettingError, Settings};
use crate::scene::{LitPoint, Scene};

/// What the window knows of a simulator before it is made: [`super::entry::Entry::simulator`].
pub struct SimulatorRow {
    /// What it is, in one line.
    pub summary: &'static str,
    /// What it starts from and how it goes on; with a change it starts over.
    pub settings: &'static [Setting],
    /// What its drawing shows.
    pub shown: &'static [Setting],
    /// When settings of both lists have an effect; those without a rule always have.
    pub rules: &'static [Rule],
    /// What it can do.
    pub actions: &'static [ActionRow],
    /// Makes one; an error tells in words why these settings cannot be used with the scene.
    pub make: MakeSimulator,
}

/// One thing that a simulator can do.
pub struct ActionRow {
    /// Its name in the window and in scripts.
    pub name: &'static str,
    /// What it does, in one line.
    pub help: &'static str,
}

/// A scene, and how its surfaces are lit.
pub struct LitScene<'s> {
    /// The scene.
    pub scene: &'s Scene,
    /// Lights them.
    pub light: LightSurfaces,
}

/// Light of points that cover all surfaces evenly, one for every square of an edge (m); an error
/// tells in words why there is none.
pub type LightSurfaces = fn(&Scene, f32) -> Result<Vec<LitPoint>, String>;

/// Makes a simulator with [`SimulatorRow::settings`].
pub type MakeSimulator = fn(&Settings, &LitScene<'_>) -> Result<Box<dyn Simulator>, String>;

/// A method at work.
pub trait Simulator {
    /// Carries out one of [`SimulatorRow::actions`], with what is shown by
    /// [`SimulatorRow::shown`].
    fn act(&mut self, action: usize, shown: &Settings);

    /// The actions of a whole run with so many steps, in their order.
    fn automatic(&self, steps: u32) -> Vec<usize>;

    /// What is known now: names, and numbers in words with their units.
    fn figures(&self) -> Vec<(&'static str, String)>;

    /// The largest value at which a whole number of [`SimulatorRow::shown`] still makes a
    /// difference; `None` where its own range says it. Larger values are taken for this one.
    fn most(&self, setting: &str) -> Option<u32>;

    /// What there is now, by [`SimulatorRow::shown`].
    fn draw(&self, shown: &Settings) -> Drawing;
}

impl SimulatorRow {
    /// Defaults of one of the lists, with `KEY=VALUE` pairs on top.
    pub fn values(list: &[Setting], pairs: &[String]) -> Result<Settings, SettingError> {
        Settings::new(&[list], &[], None, pairs)
    }

    /// Whether a change of a setting can have an effect with the values of its list.
    pub fn applies(&self, setting: &str, values: &Settings) -> bool {
        let rule = |rule: &&Rule| rule.settings.contains(&setting);
        self.rules
            .iter()
            .find(rule)
            .is_none_or(|rule| (rule.applies)(values))
    }
}

/// A drawing of flat shapes, on white: x goes to the right, y up.
#[derive(Clone, Debug, PartialEq)]
pub struct Drawing {
    /// What it shows.
    pub title: String,
    /// What its lengths and colours mean.
    pub legend: String,
    /// Width and height; shapes are between 0 and these.
    pub size: [u32; 2],
    /// The first is the lowest.
    pub shapes: Vec<Shape>,
}

/// Part of a drawing.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// From place to place.
    Line([[f64; 2]; 2], Ink),
    /// An area that is seen whole from its centre, filled in part.
    Star {
        /// Its centre.
        centre: [f64; 2],
        /// Around it, without the first point again.
        outline: Vec<[f64; 2]>,
        /// Of its outline; the area has [`Shape::FILL`] of it.
        ink: Ink,
    },
}

impl Shape {
    /// How opaque areas are.
    pub const FILL: f64 = 0.45;
}

/// How a line is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ink {
    /// Its colour, sRGB.
    pub rgb: [u8; 3],
    /// How wide it is (px).
    pub width_px: u32,
}
