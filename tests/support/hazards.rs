//! Vulkan's rules of synchronization, followed by brute force: what a planned frame must satisfy.

use lumivox::graph::plan::{Barrier, Span, Use};
use lumivox::graph::{Access, vk};

/// The rules of Vulkan for one mip and layer, followed naively: everything since the beginning is remembered, nothing is merged or forgotten.
#[derive(Default)]
struct Model {
    events: Vec<Event>,
    layout: vk::ImageLayout,
}

/// One past access, and how far the barriers since have carried it.
struct Event {
    stage: vk::PipelineStageFlags2,
    access: vk::AccessFlags2,
    writes: bool,
    /// Stages that come after it, by chains of barriers.
    ordered: vk::PipelineStageFlags2,
    /// Whether its writes have been flushed.
    available: bool,
    /// Stages and accesses that see its writes.
    visible: Vec<(vk::PipelineStageFlags2, vk::AccessFlags2)>,
}

impl Model {
    fn barrier(&mut self, barrier: &Barrier) -> Result<(), String> {
        let transition = barrier.old_layout != barrier.new_layout;
        if transition && self.layout != barrier.old_layout {
            return Err("change from a layout that the image is not in".into());
        }
        for event in &mut self.events {
            let directly = !event.stage.is_empty() && barrier.src.stage.contains(event.stage);
            let in_scope = directly || event.ordered.intersects(barrier.src.stage);
            if !in_scope {
                if transition {
                    return Err("change of layout while the image is in use".into());
                }
                continue;
            }
            event.ordered |= barrier.dst.stage;
            event.available |= event.writes && barrier.src.stage.contains(event.stage) && barrier.src.access.contains(written(event.access));
            if event.available {
                event.visible.push((barrier.dst.stage, barrier.dst.access));
            }
            if transition && event.writes && !event.available {
                return Err("change of layout before a write was flushed".into());
            }
        }
        if transition {
            // The change reads and writes every texel; the stages that waited for it come after, and see it.
            let (stage, visible) = (vk::PipelineStageFlags2::NONE, vec![(barrier.dst.stage, barrier.dst.access)]);
            let access = vk::AccessFlags2::NONE;
            self.events.push(Event { stage, access, writes: true, ordered: barrier.dst.stage, available: true, visible });
            self.layout = barrier.new_layout;
        }
        Ok(())
    }

    /// Checks one access against every earlier one, not only the last.
    fn check(&self, access: Access, layout: vk::ImageLayout) -> Result<(), String> {
        let need = access.sync();
        if self.layout != layout {
            return Err(format!("{access:?} in layout {:?}", self.layout));
        }
        let reads = need.access & !written(need.access);
        for event in self.events.iter().filter(|event| event.writes || need.writes) {
            if !event.ordered.contains(need.stage) {
                return Err(format!("{access:?} is not ordered after an earlier access"));
            }
            if event.writes && !event.available {
                return Err(format!("{access:?} comes before an earlier write is flushed"));
            }
        }
        // Visibility of the last write implies that of those before it, which it overwrote.
        let last = self.events.iter().rev().find(|event| event.writes);
        if let Some(last) = last.filter(|_| need.reads)
            && !last.visible.iter().any(|(stage, access)| stage.contains(need.stage) && access.contains(reads))
        {
            return Err(format!("{access:?} does not see the last write"));
        }
        Ok(())
    }

    fn record(&mut self, access: Access) {
        let need = access.sync();
        let (ordered, visible) = (vk::PipelineStageFlags2::NONE, Vec::new());
        self.events.push(Event { stage: need.stage, access: need.access, writes: need.writes, ordered, available: false, visible });
    }
}

fn written(access: vk::AccessFlags2) -> vk::AccessFlags2 {
    use vk::AccessFlags2 as A;
    access & (A::SHADER_STORAGE_WRITE | A::COLOR_ATTACHMENT_WRITE | A::DEPTH_STENCIL_ATTACHMENT_WRITE | A::TRANSFER_WRITE)
}

/// Plays passes and barriers through one model for each mip and layer.
pub fn verify(passes: &[Vec<Use>], barriers: &[Vec<Barrier>]) -> Result<(), String> {
    let mut models = std::collections::BTreeMap::<(u64, u32, u32), Model>::new();
    let cells = |resource: u64, mips: Span, layers: Span| {
        (mips.first..mips.first + mips.count).flat_map(move |mip| (layers.first..layers.first + layers.count).map(move |layer| (resource, mip, layer)))
    };
    for (index, (uses, barriers)) in passes.iter().zip(barriers).enumerate() {
        for barrier in barriers {
            for key in cells(barrier.resource, barrier.mips, barrier.layers) {
                models.entry(key).or_default().barrier(barrier).map_err(|error| format!("pass {index}, {key:?}: {error}"))?;
            }
        }
        for check in [true, false] {
            for used in uses {
                let is_image = used.kind == lumivox::graph::plan::ResourceKind::Image;
                let layout = if is_image { used.access.sync().layout } else { vk::ImageLayout::UNDEFINED };
                for key in cells(used.resource, used.mips, used.layers) {
                    let model = models.entry(key).or_default();
                    if check {
                        model.check(used.access, layout).map_err(|error| format!("pass {index}, {key:?}: {error}"))?;
                    } else {
                        model.record(used.access);
                    }
                }
            }
        }
    }
    Ok(())
}
