//! Acceleration structures: small frames of their own, waited for.

use std::sync::Arc;

use bytemuck::cast_slice;

use super::frame::{Frame, Resource, Work};
use super::plan::Use;
use super::{Access, Gpu};
use crate::vulkan::{AccelerationStructure, BufferDesc, BufferUsage, Error, Owner, StructureKind};

/// The coordinates of a triangle's corners (m).
pub type Corners = [[f32; 3]; 3];

impl Gpu {
    /// Builds the acceleration structure of some triangles, which `moves` says may move later, and
    /// waits. It is traced as a part of another ([`Gpu::build_parts`]). Needs
    /// [`crate::vulkan::Features::ray_query`].
    pub fn build_triangles(
        &self,
        (name, owner): (&str, Owner),
        corners: &[Corners],
        moves: bool,
    ) -> Result<Arc<AccelerationStructure>, Error> {
        let count = corners.len() as u32;
        let kind = StructureKind::Triangles { count, moves };
        let structure = self.create_structure((name, owner), kind)?;
        self.build(&structure, cast_slice(corners), false)?;
        Ok(structure)
    }

    /// Brings an acceleration structure up to where its triangles are now, and waits. Those that it
    /// is a part of have to be built again.
    pub fn follow_triangles(
        &self,
        structure: &Arc<AccelerationStructure>,
        corners: &[Corners],
    ) -> Result<(), Error> {
        self.build(structure, cast_slice(corners), true)
    }

    /// Builds the acceleration structure that is made of others, and waits.
    pub fn build_parts(
        &self,
        (name, owner): (&str, Owner),
        parts: Vec<Arc<AccelerationStructure>>,
    ) -> Result<Arc<AccelerationStructure>, Error> {
        let structure = self.create_structure((name, owner), StructureKind::Parts(parts))?;
        self.follow_parts(&structure)?;
        Ok(structure)
    }

    /// Builds the acceleration structure that is made of others again, and waits.
    pub fn follow_parts(&self, structure: &Arc<AccelerationStructure>) -> Result<(), Error> {
        self.build(structure, cast_slice(&structure.instances()), false)
    }

    fn build(
        &self,
        structure: &Arc<AccelerationStructure>,
        bytes: &[u8],
        follows: bool,
    ) -> Result<(), Error> {
        let name = structure.name();
        let part = |what: &str, size_bytes: u64, usage: BufferUsage| {
            self.create_buffer(&BufferDesc {
                name: format!("{name} ({what})"),
                size_bytes,
                usage,
                owner: Owner::Shared,
            })
        };
        let input = part("input", bytes.len() as u64, BufferUsage::StructureInput)?;
        input.write_mapped(0, bytes);
        let scratch = part(
            "scratch",
            structure.scratch_bytes(follows),
            BufferUsage::Structure,
        )?;
        let used = |resource: Resource, access: Access| -> (Resource, Use) {
            let used = resource.used(access);
            (resource, used)
        };
        let mut uses = vec![
            used((&input).into(), Access::BuildInput),
            used((&scratch).into(), Access::BuildTarget),
            used(structure.into(), Access::BuildTarget),
        ];
        let parts = structure.parts().iter();
        uses.extend(parts.map(|part| used(part.into(), Access::BuildPart)));
        let work = Work::Build {
            structure: Arc::clone(structure),
            input,
            scratch,
            follows,
        };
        let mut frame = Frame::new();
        frame.push_untold(format!("build {name}"), uses, work);
        let stats = self.submit(frame)?;
        self.tell_later(stats);
        Ok(())
    }
}
