//! Sweeps: many techniques and settings on one scene, what each costs and how wrong it is, and
//! which of them nothing else beats.
//!
//! A [grid](grid_cases) names the cases. A [`Sweep`] measures those without a record and appends a
//! [`Point`] each to [`Records`](super::records::Records). [`Section`]s are points that
//! can be compared; from them come charts, CSV, [answers](Answer), and a [page](page()), which
//! tells what `lumivox stress` found ([`Troubles`]) beside them.

mod answer;
mod bounces;
mod command;
mod front;
mod grid;
mod machine;
mod page;
mod pictures;
mod point;
mod run;
mod section;
mod trouble;

pub use answer::{Answer, Goal, Pick, Picks, ROUGH};
pub use bounces::{BounceSetting, LeftOut, measure_left_out};
pub use command::{quoted, render as render_command};
pub use front::{Price, cheapest, distinct_front, front, near_front};
pub use grid::{DEFAULT_GRID, GridError, grid_cases};
pub use machine::Machine;
pub use page::page;
pub use pictures::PictureFolder;
pub use point::{Cost, Point, PointError, RECORD_VERSION, SweepSetup, bounces_of, bounces_text};
pub use run::{Progress, Sweep, SweepError, SweepRun};
pub use section::{Group, Section, Standing};
pub use trouble::{Finding, TroubleRun, Troubles};
