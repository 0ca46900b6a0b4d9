//! The barrier planner: a pure function from what passes declare, in the order written, to the
//! barriers between them.
//!
//! For every mip and layer of every resource it keeps the last write, what that write has been made
//! visible to, and the reads since. From these follow the only four reasons for a barrier: read
//! after write, write after write, write after read (execution only), and a change of layout.

use std::collections::BTreeMap;

use ash::vk;

use super::access::{Access, written};

/// A range of mips or layers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Span {
    /// Index of the first mip or layer.
    pub first: u32,
    /// Number of mips or layers.
    pub count: u32,
}

impl Span {
    /// One mip or layer alone.
    pub const fn one(first: u32) -> Self {
        Span { first, count: 1 }
    }

    fn indices(self) -> std::ops::Range<u32> {
        self.first..self.first + self.count
    }
}

/// Buffers have no layout, mips or layers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ResourceKind {
    /// A buffer, tracked as a whole.
    Buffer,
    /// An image, tracked by mip and layer.
    Image,
}

/// One use of a part of a resource by a pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Use {
    /// Identity of the resource.
    pub resource: u64,
    /// Buffer or image.
    pub kind: ResourceKind,
    /// Mips used; `Span::one(0)` for buffers.
    pub mips: Span,
    /// Layers used; `Span::one(0)` for buffers.
    pub layers: Span,
    /// How the pass uses the part.
    pub access: Access,
}

impl Use {
    /// Use of a whole buffer.
    pub const fn buffer(resource: u64, access: Access) -> Self {
        Use {
            resource,
            kind: ResourceKind::Buffer,
            mips: Span::one(0),
            layers: Span::one(0),
            access,
        }
    }

    /// Use of a part of an image.
    pub const fn image(resource: u64, mips: Span, layers: Span, access: Access) -> Self {
        Use {
            resource,
            kind: ResourceKind::Image,
            mips,
            layers,
            access,
        }
    }
}

/// Why a barrier is needed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Hazard {
    /// The pass reads what was written.
    ReadAfterWrite,
    /// The pass overwrites what was written.
    WriteAfterWrite,
    /// The pass overwrites what was read; nothing has to be made visible.
    WriteAfterRead,
    /// The image has to change its layout.
    Layout,
}

/// Stages and accesses, on one side of a barrier.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Scope {
    /// Pipeline stages in which the accesses happen.
    pub stage: vk::PipelineStageFlags2,
    /// Kinds of memory access in these stages.
    pub access: vk::AccessFlags2,
}

impl Scope {
    const EMPTY: Self = Scope {
        stage: vk::PipelineStageFlags2::NONE,
        access: vk::AccessFlags2::NONE,
    };

    fn covers(self, other: Scope) -> bool {
        self.stage.contains(other.stage) && self.access.contains(other.access)
    }

    fn add(&mut self, other: Scope) {
        self.stage |= other.stage;
        self.access |= other.access;
    }
}

/// Who is on the earlier side of a barrier.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Origin {
    /// Index of the pass in this plan; `None` for one of an earlier plan.
    pub pass: Option<usize>,
    /// How it used the resource.
    pub access: Access,
}

/// One barrier, on one resource, before one pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Barrier {
    /// Identity of the resource.
    pub resource: u64,
    /// Buffer or image.
    pub kind: ResourceKind,
    /// Mips that it covers; `Span::one(0)` for buffers.
    pub mips: Span,
    /// Layers that it covers; `Span::one(0)` for buffers.
    pub layers: Span,
    /// What has to be over.
    pub src: Scope,
    /// What has to wait.
    pub dst: Scope,
    /// Layout that the image is in before; `UNDEFINED` for buffers.
    pub old_layout: vk::ImageLayout,
    /// Layout that the image gets; `UNDEFINED` for buffers.
    pub new_layout: vk::ImageLayout,
    /// Why the barrier is needed.
    pub hazard: Hazard,
    /// The latest use that it waits for, if there was any.
    pub from: Option<Origin>,
    /// How the pass that waits uses the resource.
    pub to: Access,
}

/// A past use that later ones may have to wait for.
#[derive(Clone, Copy, Debug)]
struct Past {
    scope: Scope,
    origin: Origin,
}

/// What is known about one mip and layer.
#[derive(Clone, Debug, Default)]
struct Slot {
    layout: vk::ImageLayout,
    /// The last write, or the last change of layout, which counts as one.
    write: Option<Past>,
    /// What the last write is visible to.
    visible: Vec<Scope>,
    /// The reads since the last write.
    reads: Vec<Past>,
}

/// Resource, mip and layer.
type Key = (u64, u32, u32);

/// What is known about all resources between two plans.
#[derive(Clone, Debug, Default)]
pub struct State {
    slots: BTreeMap<Key, Slot>,
}

impl State {
    /// Forgets a resource that no longer exists.
    pub fn forget(&mut self, resource: u64) {
        let keys: Vec<Key> = self
            .slots
            .range((resource, 0, 0)..=(resource, u32::MAX, u32::MAX))
            .map(|(key, _)| *key)
            .collect();
        for key in keys {
            self.slots.remove(&key);
        }
    }

    /// An image of one mip and layer is in this layout, and nothing is under way with it.
    pub(super) fn enter(&mut self, image: u64, layout: vk::ImageLayout) {
        let slot = Slot {
            layout,
            ..Slot::default()
        };
        self.slots.insert((image, 0, 0), slot);
    }

    /// The layout that an image of one mip and layer is in.
    pub(super) fn layout(&self, image: u64) -> vk::ImageLayout {
        let slot = self.slots.get(&(image, 0, 0));
        slot.map_or(vk::ImageLayout::UNDEFINED, |slot| slot.layout)
    }

    /// Pass indices mean nothing in the next plan.
    fn retire(&mut self) {
        for slot in self.slots.values_mut() {
            for past in slot.write.iter_mut().chain(&mut slot.reads) {
                past.origin.pass = None;
            }
        }
    }
}

/// All that one pass does to one mip and layer.
#[derive(Clone, Copy, Debug)]
struct Need {
    kind: ResourceKind,
    scope: Scope,
    layout: vk::ImageLayout,
    reads: bool,
    writes: bool,
    access: Access,
}

/// The barriers before each pass, and what is known after the last one.
pub fn plan(passes: &[Vec<Use>], initial: &State) -> (Vec<Vec<Barrier>>, State) {
    let mut state = initial.clone();
    let barriers = passes
        .iter()
        .enumerate()
        .map(|(index, uses)| plan_pass(index, uses, &mut state))
        .collect();
    state.retire();
    (barriers, state)
}

fn plan_pass(index: usize, uses: &[Use], state: &mut State) -> Vec<Barrier> {
    let mut barriers = Vec::new();
    for (key, need) in needs(index, uses) {
        let slot = state.slots.entry(key).or_default();
        if let Some(barrier) = step(slot, key, &need, index) {
            barriers.push(barrier);
        }
    }
    merge(barriers)
}

/// Everything that one pass does, by mip and layer.
fn needs(index: usize, uses: &[Use]) -> BTreeMap<Key, Need> {
    let mut needs: BTreeMap<Key, Need> = BTreeMap::new();
    for wanted in uses {
        let sync = wanted.access.sync();
        let layout = if wanted.kind == ResourceKind::Image {
            sync.layout
        } else {
            vk::ImageLayout::UNDEFINED
        };
        let scope = Scope {
            stage: sync.stage,
            access: sync.access,
        };
        let need = Need {
            kind: wanted.kind,
            scope,
            layout,
            reads: sync.reads,
            writes: sync.writes,
            access: wanted.access,
        };
        for mip in wanted.mips.indices() {
            for layer in wanted.layers.indices() {
                let merged = needs.entry((wanted.resource, mip, layer)).or_insert(need);
                assert_eq!(
                    merged.layout, layout,
                    "pass {index} uses mip {mip}, layer {layer} of resource {} in two layouts at \
                     once",
                    wanted.resource
                );
                merged.scope.add(scope);
                merged.reads |= need.reads;
                merged.writes |= need.writes;
                merged.access = if need.writes {
                    need.access
                } else {
                    merged.access
                };
            }
        }
    }
    needs
}

/// The barrier that one need calls for, if any; and what is known after it.
fn step(
    slot: &mut Slot,
    (resource, mip, layer): Key,
    need: &Need,
    index: usize,
) -> Option<Barrier> {
    let (hazard, src, from) = match reason(slot, need) {
        Some((hazard, src, from)) => (Some(hazard), src, from),
        None => (None, Scope::EMPTY, None),
    };
    let barrier = hazard.map(|hazard| Barrier {
        resource,
        kind: need.kind,
        mips: Span::one(mip),
        layers: Span::one(layer),
        src,
        dst: if hazard == Hazard::WriteAfterRead {
            Scope {
                access: vk::AccessFlags2::NONE,
                ..need.scope
            }
        } else {
            need.scope
        },
        old_layout: slot.layout,
        new_layout: need.layout,
        hazard,
        from,
        to: need.access,
    });
    advance(slot, need, hazard, index);
    barrier
}

/// Why a need has to wait, for what, and for whom.
fn reason(slot: &Slot, need: &Need) -> Option<(Hazard, Scope, Option<Origin>)> {
    let mut reads = Scope::EMPTY;
    for read in &slot.reads {
        reads.add(Scope {
            access: vk::AccessFlags2::NONE,
            ..read.scope
        });
    }
    let last_read = slot.reads.last().map(|read| read.origin);
    let write = slot.write.map_or(Scope::EMPTY, |write| write.scope);
    let last_write = slot.write.map(|write| write.origin);
    let unseen = slot.write.is_some()
        && !slot
            .visible
            .iter()
            .any(|visible| visible.covers(read_part(need)));
    if need.layout != slot.layout {
        // Reads have waited for the write before them, so the write is available to the change of
        // layout.
        return Some(if slot.reads.is_empty() {
            (Hazard::Layout, write, last_write)
        } else {
            (Hazard::Layout, reads, last_read)
        });
    }
    if need.reads && unseen {
        let mut src = write;
        if need.writes {
            src.add(reads);
        }
        return Some((Hazard::ReadAfterWrite, src, last_write));
    }
    if need.writes && !slot.reads.is_empty() {
        return Some((Hazard::WriteAfterRead, reads, last_read));
    }
    if need.writes && slot.write.is_some() {
        Some((Hazard::WriteAfterWrite, write, last_write))
    } else {
        None
    }
}

/// The reading half of a need.
fn read_part(need: &Need) -> Scope {
    Scope {
        access: need.scope.access & !written(need.scope.access),
        ..need.scope
    }
}

fn advance(slot: &mut Slot, need: &Need, hazard: Option<Hazard>, index: usize) {
    let origin = Origin {
        pass: Some(index),
        access: need.access,
    };
    let past = |access| Past {
        scope: Scope {
            access,
            ..need.scope
        },
        origin,
    };
    slot.layout = need.layout;
    if need.writes {
        *slot = Slot {
            layout: need.layout,
            write: Some(past(written(need.scope.access))),
            visible: Vec::new(),
            reads: Vec::new(),
        };
        return;
    }
    match hazard {
        // A change of layout is a write that ends before the stages that waited for it, and is
        // visible to them.
        Some(Hazard::Layout) => {
            *slot = Slot {
                layout: need.layout,
                write: Some(past(vk::AccessFlags2::NONE)),
                visible: vec![need.scope],
                reads: Vec::new(),
            };
        }
        Some(_) => slot.visible.push(need.scope),
        None => {}
    }
    // One read of each kind is enough to wait for, the latest last: what is only ever read would
    // otherwise be known by every read of every frame.
    let read = past(need.scope.access);
    slot.reads.retain(|known| known.scope != read.scope);
    slot.reads.push(read);
}

/// Joins barriers that are equal but for neighbouring layers, then those equal but for neighbouring
/// mips.
fn merge(barriers: Vec<Barrier>) -> Vec<Barrier> {
    let by_layer = join(barriers, |last, next| {
        let fits =
            last.mips == next.mips && last.layers.first + last.layers.count == next.layers.first;
        fits.then(|| Barrier {
            layers: Span {
                count: last.layers.count + next.layers.count,
                ..last.layers
            },
            ..*last
        })
    });
    join(by_layer, |last, next| {
        let fits =
            last.layers == next.layers && last.mips.first + last.mips.count == next.mips.first;
        fits.then(|| Barrier {
            mips: Span {
                count: last.mips.count + next.mips.count,
                ..last.mips
            },
            ..*last
        })
    })
}

fn join(
    barriers: Vec<Barrier>,
    joined: impl Fn(&Barrier, &Barrier) -> Option<Barrier>,
) -> Vec<Barrier> {
    let mut result: Vec<Barrier> = Vec::with_capacity(barriers.len());
    for next in barriers {
        let alike = |last: &Barrier| {
            Barrier {
                mips: next.mips,
                layers: next.layers,
                ..*last
            } == next
        };
        match result
            .last_mut()
            .filter(|last| alike(last))
            .and_then(|last| joined(last, &next).map(|both| (last, both)))
        {
            Some((last, both)) => *last = both,
            None => result.push(next),
        }
    }
    result
}
