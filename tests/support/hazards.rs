//! Vulkan's rules of synchronization, followed by brute force: what a frame's barriers must
//! satisfy, as they were planned or as they were recorded.
//!
//! Nothing here is the renderer's: what an [`Access`] means is written a second time in
//! [`meaning`].

use std::collections::BTreeMap;

use lumivox::graph::plan::{Barrier, ResourceKind, Span, Use};
use lumivox::graph::{Access, Issued, IssuedBarrier, JournalFrame, Touch};
use vk::{AccessFlags2 as A, ImageLayout as L, PipelineStageFlags2 as S};

pub use lumivox::graph::vk;

/// What a word means to Vulkan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Meaning {
    /// The stages at which it happens, each by its own name.
    pub stages: S,
    /// Kinds of reading.
    pub reads: A,
    /// Kinds of writing.
    pub writes: A,
    /// The layout that an image is in then; of no use to buffers.
    pub layout: L,
}

/// Every word by hand, from the specification's tables of pipeline stages, "Supported Access Types"
/// and image layouts.
pub fn meaning(access: Access) -> Meaning {
    // Vertex shaders fetch vertices from storage buffers and geometry shaders choose the projection
    // of a voxelized triangle, so what they read has to wait at their stages; fragment shaders
    // store voxels and count them with atomics, which is the only writing that synchronization
    // validation does not see. Tessellation is not used, but its stages are parts of the one
    // name that stands for all before rasterization and needs no feature.
    let raster = S::VERTEX_SHADER
        | S::TESSELLATION_CONTROL_SHADER
        | S::TESSELLATION_EVALUATION_SHADER
        | S::GEOMETRY_SHADER
        | S::FRAGMENT_SHADER;
    // Depth is tested before the fragment shader or after it, as the implementation likes.
    let depth = S::EARLY_FRAGMENT_TESTS | S::LATE_FRAGMENT_TESTS;
    // Copies, blits, and clears, fills among these; each has a stage of its own, and resolves share
    // their name.
    let transfer = S::COPY | S::BLIT | S::CLEAR | S::RESOLVE;
    let (load, store, sample) = (
        A::SHADER_STORAGE_READ,
        A::SHADER_STORAGE_WRITE,
        A::SHADER_SAMPLED_READ,
    );
    // Blending and loading read what attachments hold.
    let (color_read, color_write) = (A::COLOR_ATTACHMENT_READ, A::COLOR_ATTACHMENT_WRITE);
    let (depth_read, depth_write) = (
        A::DEPTH_STENCIL_ATTACHMENT_READ,
        A::DEPTH_STENCIL_ATTACHMENT_WRITE,
    );
    let (build, structure_read) = (
        S::ACCELERATION_STRUCTURE_BUILD_KHR,
        A::ACCELERATION_STRUCTURE_READ_KHR,
    );
    let (stages, reads, writes, layout) = match access {
        Access::ComputeRead => (S::COMPUTE_SHADER, load, A::NONE, L::GENERAL),
        Access::ComputeWrite => (S::COMPUTE_SHADER, A::NONE, store, L::GENERAL),
        Access::ComputeReadWrite => (S::COMPUTE_SHADER, load, store, L::GENERAL),
        Access::ComputeSampled => (
            S::COMPUTE_SHADER,
            sample,
            A::NONE,
            L::SHADER_READ_ONLY_OPTIMAL,
        ),
        // The specification has one kind of access for what a build or a ray reads of a structure,
        // whichever level it is of.
        Access::ComputeTraced => (S::COMPUTE_SHADER, structure_read, A::NONE, L::UNDEFINED),
        Access::ComputeUniform => (S::COMPUTE_SHADER, A::UNIFORM_READ, A::NONE, L::UNDEFINED),
        Access::RasterUniform => (raster, A::UNIFORM_READ, A::NONE, L::UNDEFINED),
        Access::RasterRead => (raster, load, A::NONE, L::GENERAL),
        Access::RasterReadWrite => (raster, load, store, L::GENERAL),
        Access::RasterSampled => (raster, sample, A::NONE, L::SHADER_READ_ONLY_OPTIMAL),
        Access::ColorTarget => (
            S::COLOR_ATTACHMENT_OUTPUT,
            color_read,
            color_write,
            L::COLOR_ATTACHMENT_OPTIMAL,
        ),
        Access::DepthTarget => (depth, depth_read, depth_write, L::DEPTH_ATTACHMENT_OPTIMAL),
        Access::IndirectRead => (
            S::DRAW_INDIRECT,
            A::INDIRECT_COMMAND_READ,
            A::NONE,
            L::UNDEFINED,
        ),
        Access::IndexRead => (S::INDEX_INPUT, A::INDEX_READ, A::NONE, L::UNDEFINED),
        Access::ConditionRead => (
            S::CONDITIONAL_RENDERING_EXT,
            A::CONDITIONAL_RENDERING_READ_EXT,
            A::NONE,
            L::UNDEFINED,
        ),
        Access::TransferRead => (transfer, A::TRANSFER_READ, A::NONE, L::TRANSFER_SRC_OPTIMAL),
        Access::TransferWrite => (
            transfer,
            A::NONE,
            A::TRANSFER_WRITE,
            L::TRANSFER_DST_OPTIMAL,
        ),
        // Vertices and instances are read as shaders read.
        Access::BuildInput => (build, A::SHADER_READ, A::NONE, L::UNDEFINED),
        Access::BuildPart => (build, structure_read, A::NONE, L::UNDEFINED),
        // Scratch is read and written as structures are.
        Access::BuildTarget => (
            build,
            structure_read,
            A::ACCELERATION_STRUCTURE_WRITE_KHR,
            L::UNDEFINED,
        ),
        Access::HostRead => (S::HOST, A::HOST_READ, A::NONE, L::UNDEFINED),
        // The window's system is outside the pipeline: a semaphore stands between.
        Access::Present => (S::BOTTOM_OF_PIPE, A::NONE, A::NONE, L::PRESENT_SRC_KHR),
    };
    Meaning {
        stages,
        reads,
        writes,
        layout,
    }
}

/// The same stages, each by its own name; stages of extensions that are not used are left out.
pub fn expand(stages: S) -> S {
    let parts = [
        (
            S::PRE_RASTERIZATION_SHADERS,
            S::VERTEX_SHADER
                | S::TESSELLATION_CONTROL_SHADER
                | S::TESSELLATION_EVALUATION_SHADER
                | S::GEOMETRY_SHADER,
        ),
        (S::ALL_TRANSFER, S::COPY | S::BLIT | S::CLEAR | S::RESOLVE),
    ];
    parts
        .into_iter()
        .filter(|(whole, _)| stages.contains(*whole))
        .fold(stages, |stages, (whole, parts)| (stages & !whole) | parts)
}

/// The rules of Vulkan for one mip and layer, followed naively: everything since the beginning is
/// remembered, nothing is merged or forgotten.
#[derive(Clone, Default)]
struct Model {
    past: Vec<Past>,
    layout: L,
}

/// One past access, and how far the barriers since have carried it.
#[derive(Clone)]
struct Past {
    stages: S,
    writes: A,
    /// A change of layout writes too, but at no stage and by no kind of access.
    is_write: bool,
    /// Stages that come after it, by chains of barriers.
    ordered: S,
    /// Whether its writes have been flushed.
    available: bool,
    /// Stages and accesses that see its writes.
    visible: Vec<(S, A)>,
}

impl Model {
    fn barrier(&mut self, barrier: &IssuedBarrier) -> Result<(), String> {
        let (src, dst) = (expand(barrier.src.stage), expand(barrier.dst.stage));
        let transition = barrier.old_layout != barrier.new_layout;
        if transition && self.layout != barrier.old_layout {
            return Err("change from a layout that the image is not in".into());
        }
        for past in &mut self.past {
            let directly = !past.stages.is_empty() && src.contains(past.stages);
            let in_scope =
                directly || past.ordered.intersects(src) || src.contains(S::ALL_COMMANDS);
            if !in_scope {
                if transition {
                    return Err("change of layout while the image is in use".into());
                }
                continue;
            }
            past.ordered |= dst;
            past.available |= past.is_write
                && src.contains(past.stages)
                && barrier.src.access.contains(past.writes);
            if past.available {
                past.visible.push((dst, barrier.dst.access));
            }
            if transition && past.is_write && !past.available {
                return Err("change of layout before a write was flushed".into());
            }
        }
        if transition {
            // The change reads and writes every texel; the stages that waited for it come after,
            // and see it.
            let visible = vec![(dst, barrier.dst.access)];
            self.past.push(Past {
                stages: S::NONE,
                writes: A::NONE,
                is_write: true,
                ordered: dst,
                available: true,
                visible,
            });
            self.layout = barrier.new_layout;
        }
        Ok(())
    }

    /// Checks one access against every earlier one, not only the last.
    fn check(&self, access: Access, layout: L) -> Result<(), String> {
        let need = meaning(access);
        if self.layout != layout {
            return Err(format!(
                "{access:?} in layout {layout:?} of what is in {:?}",
                self.layout
            ));
        }
        for past in self
            .past
            .iter()
            .filter(|past| past.is_write || !need.writes.is_empty())
        {
            if !past.ordered.contains(need.stages) {
                return Err(format!("{access:?} is not ordered after an earlier access"));
            }
            if past.is_write && !past.available {
                return Err(format!(
                    "{access:?} comes before an earlier write is flushed"
                ));
            }
        }
        // Visibility of the last write implies that of those before it, which it overwrote.
        let last = self.past.iter().rev().find(|past| past.is_write);
        if let Some(last) = last.filter(|_| !need.reads.is_empty())
            && !last
                .visible
                .iter()
                .any(|(stages, access)| stages.contains(need.stages) && access.contains(need.reads))
        {
            return Err(format!("{access:?} does not see the last write"));
        }
        Ok(())
    }

    fn record(&mut self, access: Access) {
        let Meaning { stages, writes, .. } = meaning(access);
        self.past.push(Past {
            stages,
            writes,
            is_write: !writes.is_empty(),
            ordered: S::NONE,
            available: false,
            visible: Vec::new(),
        });
    }
}

/// One thing that happens to one resource.
enum Event {
    Barrier(IssuedBarrier),
    /// All that one step does to it, in no order.
    Step(Vec<Touch>),
}

/// The models of all mips and layers of one resource.
#[derive(Clone, Default)]
struct Cells(BTreeMap<(u32, u32), Model>);

impl Cells {
    fn play(&mut self, event: &Event) -> Result<(), String> {
        let cells = |mips: Span, layers: Span| {
            (mips.first..mips.first + mips.count).flat_map(move |mip| {
                (layers.first..layers.first + layers.count).map(move |layer| (mip, layer))
            })
        };
        let at = |cell: (u32, u32)| move |error: String| format!("mip and layer {cell:?}: {error}");
        match event {
            Event::Barrier(barrier) => cells(barrier.mips, barrier.layers).try_for_each(|cell| {
                self.0
                    .entry(cell)
                    .or_default()
                    .barrier(barrier)
                    .map_err(at(cell))
            }),
            Event::Step(touches) => {
                for Touch { used, layout } in touches {
                    cells(used.mips, used.layers).try_for_each(|cell| {
                        self.0
                            .entry(cell)
                            .or_default()
                            .check(used.access, *layout)
                            .map_err(at(cell))
                    })?;
                }
                for Touch { used, .. } in touches {
                    cells(used.mips, used.layers)
                        .for_each(|cell| self.0.entry(cell).or_default().record(used.access));
                }
                Ok(())
            }
        }
    }
}

/// Barriers and steps in order, apart for each resource; each with the number of its step.
#[derive(Default)]
pub struct Stream {
    names: Vec<String>,
    resources: BTreeMap<u64, Vec<(usize, Event)>>,
}

impl Stream {
    /// What a plan says.
    pub fn planned(passes: &[Vec<Use>], barriers: &[Vec<Barrier>]) -> Stream {
        let mut stream = Stream::default();
        for (index, (uses, barriers)) in passes.iter().zip(barriers).enumerate() {
            for &Barrier {
                resource,
                mips,
                layers,
                src,
                dst,
                old_layout,
                new_layout,
                ..
            } in barriers
            {
                stream.barrier(IssuedBarrier {
                    resource,
                    mips,
                    layers,
                    src,
                    dst,
                    old_layout,
                    new_layout,
                });
            }
            stream.step(
                &format!("pass {index}"),
                uses.iter().map(declared).collect(),
            );
        }
        stream
    }

    /// What was recorded; an error where commands reach what their step does not name, or do not
    /// reach what it names.
    pub fn recorded(journal: &[JournalFrame]) -> Result<Stream, String> {
        let mut stream = Stream::default();
        for frame in journal {
            let mut steps = frame.names.iter().zip(&frame.uses);
            for issued in &frame.issued {
                if let Issued::Barrier(barrier) = issued {
                    stream.barrier(*barrier);
                    continue;
                }
                let (name, uses) = steps
                    .next()
                    .ok_or("more was recorded than the frame has steps")?;
                let (touched, materials) = match issued {
                    Issued::Barrier(_) => unreachable!("handled above"),
                    Issued::Nothing => (uses.iter().map(declared).collect(), &[][..]),
                    Issued::Transfer(touched) => (touched.clone(), &[][..]),
                    Issued::Pass {
                        touched, materials, ..
                    } => (touched.clone(), &materials[..]),
                };
                check_step(uses, &touched).map_err(|error| format!("{name}: {error}"))?;
                let mut all = touched;
                for material in materials {
                    if !all.contains(material) {
                        all.push(*material);
                    }
                }
                stream.step(name, all);
            }
            if let Some((name, _)) = steps.next() {
                return Err(format!("{name} was not recorded"));
            }
        }
        Ok(stream)
    }

    /// Adds a barrier before the next step.
    pub fn barrier(&mut self, barrier: IssuedBarrier) {
        self.resources
            .entry(barrier.resource)
            .or_default()
            .push((self.names.len(), Event::Barrier(barrier)));
    }

    /// Adds a step.
    pub fn step(&mut self, name: &str, touches: Vec<Touch>) {
        let mut by_resource = BTreeMap::<u64, Vec<Touch>>::new();
        touches.into_iter().for_each(|touch| {
            by_resource
                .entry(touch.used.resource)
                .or_default()
                .push(touch)
        });
        for (resource, touches) in by_resource {
            self.resources
                .entry(resource)
                .or_default()
                .push((self.names.len(), Event::Step(touches)));
        }
        self.names.push(name.to_owned());
    }

    /// All barriers.
    pub fn barriers(&self) -> Vec<IssuedBarrier> {
        let barrier = |event: &Event| {
            if let Event::Barrier(barrier) = event {
                Some(*barrier)
            } else {
                None
            }
        };
        self.resources
            .values()
            .flatten()
            .filter_map(|(_, event)| barrier(event))
            .collect()
    }

    /// Plays everything through one model for each mip and layer.
    pub fn verify(&self) -> Result<(), String> {
        for (resource, events) in &self.resources {
            let mut cells = Cells::default();
            for (step, event) in events {
                cells.play(event).map_err(|error| {
                    format!("{}, resource {resource}, {error}", self.name(*step))
                })?;
            }
        }
        Ok(())
    }

    /// A barrier without which all would still be well, in words. What comes before it is played
    /// once for all barriers of a resource.
    pub fn spare_barrier(&self) -> Option<String> {
        for events in self.resources.values() {
            let mut cells = Cells::default();
            for (index, (step, event)) in events.iter().enumerate() {
                if let Event::Barrier(barrier) = event {
                    let mut without = cells.clone();
                    if events[index + 1..]
                        .iter()
                        .all(|(_, later)| without.play(later).is_ok())
                    {
                        return Some(format!(
                            "{barrier:?} before {} is not needed",
                            self.name(*step)
                        ));
                    }
                }
                // A stream that is wrong is for `verify` to tell.
                let _ = cells.play(event);
            }
        }
        None
    }

    fn name(&self, step: usize) -> &str {
        self.names.get(step).map_or("the end", String::as_str)
    }
}

/// A use as a touch, in the layout that it asks for.
pub fn declared(used: &Use) -> Touch {
    Touch {
        used: *used,
        layout: if used.kind == ResourceKind::Image {
            meaning(used.access).layout
        } else {
            L::UNDEFINED
        },
    }
}

/// Commands reach what their step names, in the same way: each something of what is named, and of
/// all that is named something.
fn check_step(uses: &[Use], touched: &[Touch]) -> Result<(), String> {
    let inside = |part: Span, whole: Span| {
        part.count > 0
            && whole.first <= part.first
            && part.first + part.count <= whole.first + whole.count
    };
    let fits = |touch: &Touch, used: &Use| {
        let same = (touch.used.resource, touch.used.kind, touch.used.access)
            == (used.resource, used.kind, used.access);
        same && inside(touch.used.mips, used.mips) && inside(touch.used.layers, used.layers)
    };
    if let Some(touch) = touched
        .iter()
        .find(|touch| !uses.iter().any(|used| fits(touch, used)))
    {
        return Err(format!("it reaches {touch:?}, which its uses do not name"));
    }
    match uses
        .iter()
        .find(|used| !touched.iter().any(|touch| fits(touch, used)))
    {
        Some(used) => Err(format!("it does not reach {used:?}, which its uses name")),
        None => Ok(()),
    }
}

/// Whether the barriers of a plan are enough.
pub fn verify(passes: &[Vec<Use>], barriers: &[Vec<Barrier>]) -> Result<(), String> {
    Stream::planned(passes, barriers).verify()
}
