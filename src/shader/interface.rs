//! What a module asks of its pipeline. A module that is compiled while the program runs may only
//! replace a module that asks the same.

use std::collections::{BTreeMap, BTreeSet};

/// Opcodes and decorations of the SPIR-V specification, section 3.
mod op {
    pub(super) const ENTRY_POINT: u32 = 15;
    pub(super) const EXECUTION_MODE: u32 = 16;
    pub(super) const TYPE_POINTER: u32 = 32;
    pub(super) const TYPE_FIRST: u32 = 19;
    pub(super) const TYPE_LAST: u32 = 39;
    pub(super) const VARIABLE: u32 = 59;
    pub(super) const DECORATE: u32 = 71;
    pub(super) const MEMBER_DECORATE: u32 = 72;
    pub(super) const LOCAL_SIZE: u32 = 17;
    pub(super) const BINDING: u32 = 33;
    pub(super) const DESCRIPTOR_SET: u32 = 34;
    pub(super) const OFFSET: u32 = 35;
    pub(super) const SPEC_ID: u32 = 1;
    pub(super) const BUILT_IN: u32 = 11;
    pub(super) const NUM_WORKGROUPS: u32 = 24;
    pub(super) const PUSH_CONSTANT: u32 = 9;
}

/// Opcode of a type of images.
pub(super) const TYPE_IMAGE: u32 = 25;

/// Number of the format RGBA16F (SPIR-V specification, section 3.11).
pub(super) const RGBA16F: u32 = 2;

/// Whether an `OpTypeImage` is that of a two-dimensional RGBA32F storage image, by what it says
/// after its result: sampled type, dimensions, depth, arrayed, multisampled, sampled, format.
pub(super) fn is_full_image(kind: &[u32]) -> bool {
    const D2: u32 = 1;
    const STORAGE: u32 = 2;
    const RGBA32F: u32 = 1;
    matches!(kind, [_, D2, _, _, _, STORAGE, RGBA32F])
}

/// Descriptors, push constants, specialization constants, stage and workgroup of a module.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Interface {
    /// Set, binding, storage class and opcode of the type.
    descriptors: BTreeSet<[u32; 4]>,
    /// Offsets of the push constants (bytes).
    push_offsets: BTreeSet<u32>,
    spec_ids: BTreeSet<u32>,
    /// Whether it reads how many workgroups there are.
    counts_groups: bool,
    /// Bindings of set 1 that are two-dimensional RGBA32F storage images.
    full_images: BTreeSet<u32>,
    /// Execution model, then the workgroup of a compute shader.
    stage: Vec<u32>,
}

impl Interface {
    /// Reads a module; `None` where the words are no SPIR-V.
    pub fn of(words: &[u32]) -> Option<Self> {
        if words.first() != Some(&0x0723_0203) {
            return None;
        }
        let mut found = Interface::default();
        let (mut sets, mut bindings, mut pointers, mut types) = (
            BTreeMap::new(),
            BTreeMap::new(),
            BTreeMap::new(),
            BTreeMap::new(),
        );
        let (mut offsets, mut variables): (BTreeMap<u32, BTreeSet<u32>>, Vec<[u32; 3]>) =
            (BTreeMap::new(), Vec::new());
        let mut rest = words.get(5..)?;
        while let [first, ..] = *rest {
            let (opcode, length) = (first & 0xffff, (first >> 16) as usize);
            let operands = rest.get(1..length)?;
            match (opcode, operands) {
                (op::ENTRY_POINT, [model, ..]) => found.stage.insert(0, *model),
                (op::EXECUTION_MODE, [_, op::LOCAL_SIZE, size @ ..]) => found.stage.extend(size),
                (op::DECORATE, [id, op::DESCRIPTOR_SET, set]) => drop(sets.insert(*id, *set)),
                (op::DECORATE, [id, op::BINDING, binding]) => drop(bindings.insert(*id, *binding)),
                (op::DECORATE, [_, op::SPEC_ID, id]) => drop(found.spec_ids.insert(*id)),
                (op::DECORATE, [_, op::BUILT_IN, op::NUM_WORKGROUPS]) => found.counts_groups = true,
                (op::MEMBER_DECORATE, [id, _, op::OFFSET, offset]) => {
                    offsets.entry(*id).or_default().insert(*offset);
                }
                (op::TYPE_POINTER, [id, _, target]) => drop(pointers.insert(*id, *target)),
                (op::VARIABLE, [kind, id, class, ..]) => variables.push([*kind, *id, *class]),
                (op::TYPE_FIRST..=op::TYPE_LAST, [id, kind @ ..]) => {
                    let is_full = opcode == TYPE_IMAGE && is_full_image(kind);
                    types.insert(*id, (opcode, is_full));
                }
                _ => {}
            }
            rest = rest.get(length.max(1)..)?;
        }
        for [kind, id, class] in variables {
            let target = pointers.get(&kind).copied().unwrap_or_default();
            if class == op::PUSH_CONSTANT {
                found
                    .push_offsets
                    .extend(offsets.get(&target).into_iter().flatten());
            }
            if let (Some(set), Some(binding)) = (sets.get(&id), bindings.get(&id)) {
                let (opcode, is_full) = types.get(&target).copied().unwrap_or_default();
                found.descriptors.insert([*set, *binding, class, opcode]);
                if is_full && *set == 1 {
                    found.full_images.insert(*binding);
                }
            }
        }
        Some(found)
    }

    /// Whether it reads how many workgroups there are, so that all have to be in one dispatch.
    pub fn counts_groups(&self) -> bool {
        self.counts_groups
    }

    /// Bindings of a pass's own set that are two-dimensional RGBA32F storage images.
    pub fn full_images(&self) -> impl Iterator<Item = u32> {
        self.full_images.iter().copied()
    }

    /// Whether it has a specialization constant of this number.
    pub fn has_constant(&self, number: u32) -> bool {
        self.spec_ids.contains(&number)
    }

    /// What differs from another module's interface, in words; `None` where nothing does.
    pub fn difference(&self, other: &Interface) -> Option<&'static str> {
        if self.stage != other.stage {
            return Some("its stage or workgroup");
        }
        if self.push_offsets != other.push_offsets {
            return Some("its push constants");
        }
        if !other.spec_ids.is_subset(&self.spec_ids) {
            return Some("its specialization constants");
        }
        // What the compiler has found unused may be missing.
        (!other.descriptors.is_subset(&self.descriptors)).then_some("its bindings")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn modules_differ_where_their_declarations_do() {
        let interface = |stem: &str| {
            crate::shader::words(stem)
                .ok()
                .and_then(|words| Interface::of(&words))
                .unwrap_or_default()
        };
        let composite = interface("render/screen/composite.comp");
        assert_eq!(composite.difference(&composite), None);
        assert!(
            !composite.descriptors.is_empty()
                && composite.stage.len() == 4
                && composite.spec_ids.len() == 3
        );
        assert_eq!(
            composite.difference(&interface("render/screen/gbuffer.frag")),
            Some("its stage or workgroup")
        );
        assert_eq!(
            interface("render/screen/pick.comp").difference(&composite),
            Some("its specialization constants")
        );
        let fewer = Interface {
            descriptors: composite.descriptors.iter().copied().skip(1).collect(),
            ..composite.clone()
        };
        assert_eq!(
            (composite.difference(&fewer), fewer.difference(&composite)),
            (None, Some("its bindings"))
        );
        assert_eq!(Interface::of(&[1, 2, 3]), None);
        let push = interface("render/lights/light_view.vert");
        assert!(!push.push_offsets.is_empty());
    }
}
