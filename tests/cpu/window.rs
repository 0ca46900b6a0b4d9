//! The barriers of the window, played through the model of Vulkan's rules.

use crate::support::hazards::{Stream, declared};
use lumivox::graph::plan::{Scope, Span, Use};
use lumivox::graph::{Access, IssuedBarrier, Touch, vk};
use lumivox::vulkan::{ACQUIRED_BEFORE, capture_barrier, window_barriers};

use Access::{HostRead, TransferRead, TransferWrite};

/// Two frames of the window on one image, each between the semaphores that the window's system
/// waits for and signals, and a picture that is read back.
fn window_frames(is_copied: bool, change: impl Fn(&mut Vec<IssuedBarrier>)) -> Stream {
    const IMAGE: u64 = 1;
    const CAPTURE: u64 = 2;
    let image = |access| declared(&Use::image(IMAGE, Span::one(0), Span::one(0), access));
    let mut barriers: Vec<_> = window_barriers(vk::Image::null(), is_copied)
        .iter()
        .map(|barrier| IssuedBarrier::of_image(IMAGE, barrier))
        .collect();
    if is_copied {
        barriers.insert(
            2,
            IssuedBarrier::of_buffer(CAPTURE, &capture_barrier(vk::Buffer::null())),
        );
    }
    change(&mut barriers);
    // A semaphore orders stages; what is shown has been flushed by the change of layout.
    let semaphore = |src, dst| {
        let scope = |stage| Scope {
            stage,
            access: vk::AccessFlags2::NONE,
        };
        let layout = vk::ImageLayout::UNDEFINED;
        IssuedBarrier {
            resource: IMAGE,
            mips: Span::one(0),
            layers: Span::one(0),
            src: scope(src),
            dst: scope(dst),
            old_layout: layout,
            new_layout: layout,
        }
    };
    let mut barriers = barriers.into_iter();
    let mut stream = Stream::default();
    stream.step(
        "an earlier frame is shown",
        vec![Touch {
            layout: vk::ImageLayout::UNDEFINED,
            ..image(Access::Present)
        }],
    );
    stream.barrier(semaphore(
        vk::PipelineStageFlags2::BOTTOM_OF_PIPE,
        ACQUIRED_BEFORE,
    ));
    barriers
        .next()
        .into_iter()
        .for_each(|barrier| stream.barrier(barrier));
    stream.step("draw", vec![image(Access::ColorTarget)]);
    if is_copied {
        barriers
            .next()
            .into_iter()
            .for_each(|barrier| stream.barrier(barrier));
        stream.step(
            "copy",
            vec![
                image(TransferRead),
                declared(&Use::buffer(CAPTURE, TransferWrite)),
            ],
        );
    }
    barriers.for_each(|barrier| stream.barrier(barrier));
    stream.barrier(semaphore(
        vk::PipelineStageFlags2::ALL_COMMANDS,
        vk::PipelineStageFlags2::BOTTOM_OF_PIPE,
    ));
    let read = is_copied.then(|| declared(&Use::buffer(CAPTURE, HostRead)));
    stream.step(
        "show",
        [image(Access::Present)].into_iter().chain(read).collect(),
    );
    stream
}

#[test]
fn the_barriers_of_the_window_are_enough_and_a_changed_one_is_noticed() {
    for is_copied in [false, true] {
        let stream = window_frames(is_copied, |_| ());
        assert_eq!(stream.verify(), Ok(()));
        let changes: [fn(&mut IssuedBarrier); 5] = [
            |barrier| barrier.src.stage = vk::PipelineStageFlags2::NONE,
            |barrier| barrier.src.access = vk::AccessFlags2::NONE,
            |barrier| barrier.dst.stage = vk::PipelineStageFlags2::NONE,
            |barrier| barrier.dst.access = vk::AccessFlags2::NONE,
            |barrier| barrier.new_layout = vk::ImageLayout::GENERAL,
        ];
        for index in 0..if is_copied { 4 } else { 2 } {
            for (number, change) in changes.iter().enumerate() {
                let changed = window_frames(is_copied, |barriers| change(&mut barriers[index]));
                let same = window_frames(is_copied, |_| ());
                let is_change =
                    format!("{:?}", changed.barriers()) != format!("{:?}", same.barriers());
                assert_eq!(
                    changed.verify().is_err(),
                    is_change,
                    "copied: {is_copied}, barrier {index}, change {number}"
                );
            }
        }
    }
}

/// A barrier on less than a buffer covers nothing.
#[test]
fn a_barrier_on_a_part_of_a_buffer_is_not_taken_for_one_on_all_of_it() {
    let barrier = capture_barrier(vk::Buffer::null());
    assert_eq!(IssuedBarrier::of_buffer(1, &barrier).mips, Span::one(0));
    assert_eq!(IssuedBarrier::of_buffer(1, &barrier.size(4)).mips.count, 0);
    assert_eq!(
        IssuedBarrier::of_buffer(1, &barrier.offset(4)).mips.count,
        0
    );
}
