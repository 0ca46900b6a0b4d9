//! Light and walls of a command line.

use glam::{DVec3, UVec3};

use super::{Emission, Injected, Setup};

/// Light that is put into cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Injector {
    /// All cells of a layer across the main axis of the direction.
    Wall {
        /// Which layer, from 0; without one, an eighth of the grid behind its border.
        layer: Option<u32>,
        /// Main direction of the light; without one, that of the command.
        direction: Option<DVec3>,
    },
    /// One cell.
    Cell {
        /// Which; without one, the middle one.
        cell: Option<UVec3>,
        /// Main direction of the light; without one, that of the command.
        direction: Option<DVec3>,
    },
}

/// Opaque faces across an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Occluder {
    /// 0 to 2.
    pub axis: usize,
    /// It is between the cells `plane` − 1 and `plane`.
    pub plane: u32,
    /// First cell, and the one after the last, along the two next axes (of x: y and z; of y: z and
    /// x); without them, all.
    pub across: Option<[[u32; 2]; 2]>,
}

/// The main axis of a direction.
fn main_axis(direction: DVec3) -> usize {
    let size = direction.abs();
    if size.x >= size.y && size.x >= size.z {
        0
    } else if size.y >= size.z {
        1
    } else {
        2
    }
}

/// A whole number.
fn count(text: &str) -> Result<u32, String> {
    let text = text.trim();
    text.parse()
        .map_err(|_| format!("{text} is not a whole number from 0"))
}

/// Three numbers with commas between them.
fn three<T>(text: &str, parse: impl Fn(&str) -> Result<T, String>) -> Result<[T; 3], String> {
    let parts: Result<Vec<T>, String> = text.split(',').map(parse).collect();
    parts?
        .try_into()
        .map_err(|_| format!("{text} has to be three numbers with commas, as in 1,0,0"))
}

/// A direction, to unit length.
pub fn direction(text: &str) -> Result<DVec3, String> {
    let number = |text: &str| {
        let text = text.trim();
        text.parse().map_err(|_| format!("{text} is not a number"))
    };
    let all = DVec3::from(three::<f64>(text, number)?);
    all.try_normalize()
        .ok_or_else(|| format!("{text} is no direction; write one as 1,0,0"))
}

impl Injector {
    /// `wall[:LAYER[:DIRECTION]]` or `cell[:X,Y,Z[:DIRECTION]]`; `None` where it is neither.
    pub fn parse(text: &str) -> Option<Result<Self, String>> {
        let mut parts = text.split(':');
        let kind = parts.next()?;
        let (place, towards, more) = (parts.next(), parts.next(), parts.next());
        let known = |build: &dyn Fn() -> Result<Self, String>| {
            if more.is_some() {
                return Err(format!("{text} has more parts than KIND:PLACE:DIRECTION"));
            }
            build()
        };
        let direction = || towards.map(direction).transpose();
        match kind {
            "wall" => Some(known(&|| {
                Ok(Injector::Wall {
                    layer: place.map(count).transpose()?,
                    direction: direction()?,
                })
            })),
            "cell" => Some(known(&|| {
                let cell = place.map(|place| three(place, count)).transpose()?;
                Ok(Injector::Cell {
                    cell: cell.map(UVec3::from),
                    direction: direction()?,
                })
            })),
            _ => None,
        }
    }

    /// Adds its light: `multiplier` W a cell, towards `direction` where it names no other.
    pub fn inject(
        &self,
        setup: &mut Setup,
        multiplier: f64,
        direction: DVec3,
    ) -> Result<(), String> {
        let size = setup.grid.size;
        let (low, end, towards) = match *self {
            Injector::Wall {
                layer,
                direction: own,
            } => {
                let towards = own.unwrap_or(direction);
                let axis = main_axis(towards);
                let margin = size[axis] / 8;
                let behind = if towards[axis] < 0.0 {
                    size[axis] - 1 - margin
                } else {
                    margin
                };
                let layer = layer.unwrap_or(behind);
                let (mut low, mut end) = (UVec3::ZERO, size);
                (low[axis], end[axis]) = (layer, layer.saturating_add(1));
                (low, end, towards)
            }
            Injector::Cell {
                cell,
                direction: own,
            } => {
                let cell = cell.unwrap_or(size / 2);
                (
                    cell,
                    cell.saturating_add(UVec3::ONE),
                    own.unwrap_or(direction),
                )
            }
        };
        if end.cmpgt(size).any() {
            return Err(format!(
                "an injector is at cell {low}, outside of a grid of {size} cells, which are \
                 counted from 0"
            ));
        }
        for z in low.z..end.z {
            for y in low.y..end.y {
                for x in low.x..end.x {
                    setup.injected.push(Injected {
                        cell: UVec3::new(x, y, z),
                        emission: Emission::Cosine(multiplier * towards),
                    });
                }
            }
        }
        Ok(())
    }
}

impl Occluder {
    /// `AXIS:PLANE`, or `AXIS:PLANE:LOW..END:LOW..END`.
    pub fn parse(text: &str) -> Result<Self, String> {
        let parts: Vec<&str> = text.split(':').collect();
        let range = |text: &str| -> Result<[u32; 2], String> {
            let (low, end) = text
                .split_once("..")
                .ok_or_else(|| format!("{text} has to be two cells, as in 4..28"))?;
            Ok([count(low)?, count(end)?])
        };
        let axis = |text: &str| match text {
            "x" => Ok(0),
            "y" => Ok(1),
            "z" => Ok(2),
            _ => Err(format!("{text} is no axis; write x, y or z")),
        };
        match parts.as_slice() {
            [along, plane] => Ok(Occluder {
                axis: axis(along)?,
                plane: count(plane)?,
                across: None,
            }),
            [along, plane, first, second] => Ok(Occluder {
                axis: axis(along)?,
                plane: count(plane)?,
                across: Some([range(first)?, range(second)?]),
            }),
            _ => Err(format!(
                "{text} has to be AXIS:PLANE or AXIS:PLANE:LOW..END:LOW..END, as in x:16 or \
                 x:16:0..32:8..24"
            )),
        }
    }

    /// Closes the faces on both sides of its plane.
    pub fn close(&self, setup: &mut Setup) -> Result<(), String> {
        let (axis, size) = (self.axis, setup.grid.size);
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let across = self.across.unwrap_or([[0, size[u]], [0, size[v]]]);
        let is_inside =
            self.plane <= size[axis] && across[0][1] <= size[u] && across[1][1] <= size[v];
        if !is_inside {
            return Err(format!(
                "an occluder is outside of the grid of {size} cells"
            ));
        }
        for first in across[0][0]..across[0][1] {
            for second in across[1][0]..across[1][1] {
                let mut cell = UVec3::ZERO;
                (cell[u], cell[v]) = (first, second);
                if self.plane < size[axis] {
                    cell[axis] = self.plane;
                    setup.faces[setup.grid.index(cell)] |= 1 << (2 * axis);
                }
                if self.plane > 0 {
                    cell[axis] = self.plane - 1;
                    setup.faces[setup.grid.index(cell)] |= 2 << (2 * axis);
                }
            }
        }
        Ok(())
    }
}
