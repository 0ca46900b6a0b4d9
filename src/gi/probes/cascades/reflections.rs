//! Reflection probes around the camera, lit by the lights and by the probes of all levels.

use glam::Vec3;

use super::layout::Layout;
use super::passes::{LIGHT_FIELD, LevelFieldParams};
use super::store::Store;
use crate::gi::Inputs;
use crate::gi::probes::lattice::Lattice;
use crate::gi::probes::lookup::Lookup;
use crate::gi::probes::rays::Moved;
use crate::gi::probes::reflection::{OUTER_LAYER, ReflectionProbes, ReflectionSettings};
use crate::gi::probes::volume::Maps;
use crate::gi::shared::paths::PathScene;
use crate::graph::{Error, Frame, Gpu};
use crate::render::bvh::SceneRays;

/// They stand through as much as this level, or the coarsest. What they do not see from there, rays
/// mirror.
const LEVEL: u32 = 2;

/// Reflection probes, and where they are.
pub(super) struct Reflections {
    layout: Layout,
    pub(super) probes: ReflectionProbes,
    /// They stand where they did not in the last frame.
    is_new: bool,
}

/// The lattice of the only level.
fn lattice(layout: &Layout, eye: Vec3) -> Lattice {
    layout.windows(eye)[0].lattice
}

impl Reflections {
    /// Around a camera at `eye` (m), among such levels.
    pub(super) fn new(
        gpu: &Gpu,
        levels: &Layout,
        eye: Vec3,
        how: ReflectionSettings,
    ) -> Result<Self, Error> {
        let layout = levels.as_wide_as(LEVEL, how.probes, OUTER_LAYER);
        Ok(Reflections {
            probes: ReflectionProbes::new(gpu, lattice(&layout, eye), how)?,
            layout,
            is_new: true,
        })
    }

    /// Stays around the camera.
    pub(super) fn follow(&mut self, gpu: &Gpu, eye: Vec3) -> Result<(), Error> {
        let lattice = lattice(&self.layout, eye);
        if self.probes.is_elsewhere(&lattice) {
            self.probes.move_to(gpu, lattice)?;
            self.is_new = true;
        }
        Ok(())
    }

    /// Adds the pass that finds out what they see, where that may have changed; whether it may.
    pub(super) fn trace(
        &mut self,
        frame: &mut Frame,
        triangles: &SceneRays,
        moved: Option<Moved>,
    ) -> bool {
        let is_new = std::mem::take(&mut self.is_new);
        let sees_else = is_new || moved.is_some();
        if sees_else {
            let moved = moved.filter(|_| !is_new);
            self.probes.trace(frame, triangles, moved);
        }
        sees_else
    }

    /// Adds the passes that light what they see, and average it. `reflected`: what places there
    /// reflect of probes, if that is a bounce that counts.
    pub(super) fn light(
        &self,
        frame: &mut Frame,
        given: &Inputs<'_>,
        (scene, uses_maps): (&PathScene, bool),
        (store, lookup): (&Store, &Lookup),
        reflected: Option<&Maps>,
    ) {
        self.probes.light(frame, |frame, field| {
            let maps = reflected.unwrap_or(store.volume().lit(1));
            let pass = scene.bind(frame.pass(&LIGHT_FIELD), given, uses_maps);
            field
                .bind_lit(store.bind(pass, lookup, maps))
                .constant("REFLECTS", reflected.is_some())
                .push(&LevelFieldParams {
                    level_count: store.levels.len() as u32,
                    edge: field.edge,
                    columns: field.columns,
                    probe_count: field.probe_count,
                })
                .dispatch(field.groups());
        });
    }
}
