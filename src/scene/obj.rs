//! OBJ geometry, parsed line by line so that every error has its line.
//!
//! Read: `v`, `vt`, `vn`, `f` (any number of corners, negative indices), `usemtl`, `mtllib`, and
//! lines that a `\` at their end continues. Everything else (groups, smoothing, lines, points,
//! free-form surfaces) is passed over. Extra numbers on `v` and `vt` (w, vertex colours) are
//! ignored. Polygons become triangles ([`super::polygon`]).

use std::collections::HashMap;
use std::path::Path;

use glam::{DVec3, Vec3};

use super::polygon::Splitter;
use super::{SceneError, paths};
use crate::text::{counted, number};

/// Stands for "no texture coordinate", "no normal" or "no material".
pub(super) const NONE: u32 = u32::MAX;

/// Largest texture coordinate: far beyond it 32-bit numbers tell no texels apart.
pub(super) const TEXCOORD_MAX: f32 = 1e9;

/// Indices of one triangle corner into the lists of [`Obj`]; texture coordinate and normal may be
/// [`NONE`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct Corner {
    /// Index of the position, from 0.
    pub(super) position: u32,
    /// Texture coordinate or [`NONE`].
    pub(super) texcoord: u32,
    /// Normal or [`NONE`].
    pub(super) normal: u32,
}

/// A parsed OBJ file.
#[derive(Debug, Default)]
pub(super) struct Obj {
    /// Positions, the lines `v`.
    pub(super) positions: Vec<Vec3>,
    /// Texture coordinates, the lines `vt`.
    pub(super) texcoords: Vec<[f32; 2]>,
    /// `vn`, as written.
    pub(super) normals: Vec<Vec3>,
    /// Triangles in file order, with an index into `material_names` or [`NONE`].
    pub(super) triangles: Vec<([Corner; 3], u32)>,
    /// `usemtl` names with the line of their first use.
    pub(super) material_names: Vec<(String, usize)>,
    /// `mtllib` arguments with their lines.
    pub(super) libraries: Vec<(String, usize)>,
    /// The line of each position.
    pub(super) position_lines: Vec<u32>,
    /// Faces that cross themselves, and the line of the first.
    pub(super) crossing: (usize, usize),
}

/// Parser state: what is read so far, and where we are.
struct Parser<'a> {
    path: &'a Path,
    line: usize,
    obj: Obj,
    materials: HashMap<String, u32>,
    material: u32,
    polygon: Vec<Corner>,
    splitter: Splitter,
}

impl Obj {
    /// Parses the text of an OBJ file; `path` is for messages only.
    pub(super) fn parse(path: &Path, text: &str) -> Result<Obj, SceneError> {
        let mut parser = Parser {
            path,
            line: 0,
            obj: Obj::default(),
            materials: HashMap::new(),
            material: NONE,
            polygon: Vec::new(),
            splitter: Splitter::default(),
        };
        for (number, line) in paths::joined_lines(text) {
            parser.line = number;
            parser.read_line(&line)?;
        }
        Ok(parser.obj)
    }

    /// Makes +y of what was +z, without rounding.
    pub(super) fn turn_z_up(&mut self) {
        for vector in self.positions.iter_mut().chain(&mut self.normals) {
            *vector = Vec3::new(vector.x, vector.z, -vector.y);
        }
    }
}

impl Parser<'_> {
    fn read_line(&mut self, line: &str) -> Result<(), SceneError> {
        let (key, rest) = line
            .trim()
            .split_once(char::is_whitespace)
            .unwrap_or((line.trim(), ""));
        // Names may hold a #; behind numbers it begins a comment.
        let (name, numbers) = (rest.trim(), rest.split('#').next().unwrap_or_default());
        match key {
            "v" => {
                let position = Vec3::from(self.numbers::<3>("v", numbers, 3)?);
                self.obj.positions.push(position);
                self.obj.position_lines.push(self.line as u32);
            }
            "vt" => {
                let texcoord = self.numbers::<2>("vt", numbers, 1)?;
                if let Some(value) = texcoord.iter().find(|value| value.abs() > TEXCOORD_MAX) {
                    let problem = format!("`vt` has {}, out of range", number(*value));
                    return Err(self.error(
                        problem,
                        &format!(
                            "it must be between {} and {}",
                            number(-TEXCOORD_MAX),
                            number(TEXCOORD_MAX)
                        ),
                    ));
                }
                self.obj.texcoords.push(texcoord);
            }
            "vn" => {
                let normal = Vec3::from(self.numbers::<3>("vn", numbers, 3)?);
                self.obj.normals.push(normal);
            }
            "f" => self.face(numbers)?,
            "usemtl" => self.use_material(name),
            "mtllib" => self.obj.libraries.push((name.to_owned(), self.line)),
            _ => {}
        }
        Ok(())
    }

    /// The first `N` numbers on the line, all finite. At least `required` of them must be there.
    fn numbers<const N: usize>(
        &self,
        key: &str,
        rest: &str,
        required: usize,
    ) -> Result<[f32; N], SceneError> {
        let mut values = [0.0_f32; N];
        let mut count = 0;
        for (value, word) in values.iter_mut().zip(rest.split_whitespace()) {
            *value = word.parse().map_err(|_| {
                self.error(
                    format!("`{key}` has `{word}`, which is not a number"),
                    "write a decimal number there",
                )
            })?;
            if !value.is_finite() {
                return Err(self.error(
                    format!("`{key}` has `{word}`, which is not finite"),
                    "export the model again without NaN and infinite values",
                ));
            }
            count += 1;
        }
        if count < required {
            return Err(self.error(
                format!(
                    "`{key}` has {} where {required} are needed",
                    counted(count, "number")
                ),
                "complete the line, or export the model again",
            ));
        }
        Ok(values)
    }

    fn use_material(&mut self, name: &str) {
        self.material = match self.materials.get(name) {
            Some(&index) => index,
            None => {
                let index = self.obj.material_names.len() as u32;
                self.obj.material_names.push((name.to_owned(), self.line));
                self.materials.insert(name.to_owned(), index);
                index
            }
        };
    }

    fn face(&mut self, rest: &str) -> Result<(), SceneError> {
        let mut polygon = std::mem::take(&mut self.polygon);
        polygon.clear();
        for word in rest.split_whitespace() {
            polygon.push(self.corner(word)?);
        }
        if polygon.len() < 3 {
            return Err(self.error(
                format!(
                    "`f` has {} corners where at least 3 are needed",
                    polygon.len()
                ),
                "remove the face, or complete it",
            ));
        }
        match polygon[..] {
            [a, b, c] => self.obj.triangles.push(([a, b, c], self.material)),
            _ => self.split(&polygon),
        }
        self.polygon = polygon;
        Ok(())
    }

    fn split(&mut self, polygon: &[Corner]) {
        let corners: Vec<DVec3> = polygon
            .iter()
            .map(|corner| self.obj.positions[corner.position as usize].as_dvec3())
            .collect();
        let split = self.splitter.split(&corners);
        let corner = |index: u32| polygon[index as usize];
        self.obj.triangles.extend(
            split
                .triangles
                .iter()
                .map(|triangle| (triangle.map(corner), self.material)),
        );
        if split.crosses_itself {
            let (count, first) = self.obj.crossing;
            self.obj.crossing = (count + 1, if count == 0 { self.line } else { first });
        }
    }

    fn corner(&self, word: &str) -> Result<Corner, SceneError> {
        let mut parts = word.split('/');
        let position = self.index(
            "v",
            parts.next().unwrap_or_default(),
            self.obj.positions.len(),
        )?;
        let texcoord = self.index(
            "vt",
            parts.next().unwrap_or_default(),
            self.obj.texcoords.len(),
        )?;
        let normal = self.index(
            "vn",
            parts.next().unwrap_or_default(),
            self.obj.normals.len(),
        )?;
        if position == NONE || parts.next().is_some() {
            return Err(self.error(
                format!("`f` has the corner `{word}`"),
                "a corner is v, v/vt, v//vn or v/vt/vn",
            ));
        }
        Ok(Corner {
            position,
            texcoord,
            normal,
        })
    }

    /// An OBJ index (from 1, or negative from the end) into `count` entries; [`NONE`] where the
    /// text is empty.
    fn index(&self, list: &str, text: &str, count: usize) -> Result<u32, SceneError> {
        if text.is_empty() {
            return Ok(NONE);
        }
        let signed: i64 = text.parse().map_err(|_| {
            self.error(
                format!("`f` has `{text}`, which is not an index"),
                "indices are whole numbers from 1",
            )
        })?;
        let index = if signed < 0 {
            count as i64 + signed
        } else {
            signed - 1
        };
        match u32::try_from(index) {
            Ok(index) if (index as usize) < count && index != NONE => Ok(index),
            _ => Err(self.error(
                format!("`f` refers to `{list}` number {signed}, but {count} are defined so far"),
                "export the model again: the file is cut short or its indices are wrong",
            )),
        }
    }

    fn error(&self, problem: String, hint: &str) -> SceneError {
        SceneError::line(self.path, self.line, problem, hint)
    }
}
