//! The barrier planner: single hazards by hand, then random frames against a brute-force model of
//! Vulkan's rules.

use std::collections::HashSet;

use crate::support::Random;
use crate::support::hazards::{Stream, declared, expand, meaning, verify};
use crate::support::passes::{COPY, DOUBLE};
use lumivox::graph::plan::{Barrier, Hazard, Span, State, Use, plan};
use lumivox::graph::{
    Access, Frame, Issued, IssuedBarrier, JournalFrame, PassTime, Spread, TimesAccumulator, Touch,
    vk,
};

use Access::{
    ComputeRead, ComputeReadWrite, ComputeSampled, ComputeWrite, HostRead, IndirectRead,
    RasterRead, RasterReadWrite, RasterSampled, TransferRead, TransferWrite,
};

/// The renderer's table of accesses against the second one, from the specification, that the model
/// follows.
#[test]
fn every_word_means_what_the_specification_says() {
    assert_eq!(Access::ALL.into_iter().collect::<HashSet<_>>().len(), 22);
    for access in Access::ALL {
        let (sync, known) = (access.sync(), meaning(access));
        assert_eq!(expand(sync.stage), known.stages, "{access:?}");
        assert_eq!(
            (sync.access, sync.layout),
            (known.reads | known.writes, known.layout),
            "{access:?}"
        );
        assert_eq!(
            (sync.reads, sync.writes),
            (!known.reads.is_empty(), !known.writes.is_empty()),
            "{access:?}"
        );
    }
}

fn buffer_plan(accesses: &[Access]) -> Vec<Vec<Barrier>> {
    let passes: Vec<Vec<Use>> = accesses
        .iter()
        .map(|access| vec![Use::buffer(1, *access)])
        .collect();
    plan(&passes, &State::default()).0
}

fn hazards(barriers: &[Vec<Barrier>]) -> Vec<Vec<Hazard>> {
    barriers
        .iter()
        .map(|barriers| barriers.iter().map(|barrier| barrier.hazard).collect())
        .collect()
}

#[test]
fn each_hazard_has_its_barrier() {
    use Hazard::{ReadAfterWrite as Raw, WriteAfterRead as War, WriteAfterWrite as Waw};
    assert_eq!(
        hazards(&buffer_plan(&[ComputeWrite, ComputeRead])),
        [vec![], vec![Raw]]
    );
    assert_eq!(
        hazards(&buffer_plan(&[ComputeRead, ComputeWrite])),
        [vec![], vec![War]]
    );
    assert_eq!(
        hazards(&buffer_plan(&[ComputeWrite, ComputeWrite])),
        [vec![], vec![Waw]]
    );
    assert_eq!(
        hazards(&buffer_plan(&[ComputeReadWrite, ComputeReadWrite])),
        [vec![], vec![Raw]]
    );
    assert_eq!(
        hazards(&buffer_plan(&[ComputeRead, RasterRead])),
        [vec![], vec![]]
    );
    assert_eq!(
        hazards(&buffer_plan(&[
            TransferWrite,
            ComputeRead,
            ComputeRead,
            RasterRead
        ])),
        [vec![], vec![Raw], vec![], vec![Raw]]
    );
}

#[test]
fn what_is_known_does_not_grow_with_the_frames() {
    let mips = Span { first: 0, count: 2 };
    let image = |access| Use::image(2, mips, Span::one(0), access);
    let upload = vec![vec![Use::buffer(1, TransferWrite), image(TransferWrite)]];
    let frame = vec![
        vec![Use::buffer(1, ComputeRead), image(ComputeSampled)],
        vec![Use::buffer(1, RasterRead), image(RasterSampled)],
        vec![Use::buffer(1, ComputeRead)],
    ];
    let (_, state) = plan(&upload, &State::default());
    let (_, mut state) = plan(&frame, &state);
    let known = format!("{state:?}");
    for _ in 0..50 {
        state = plan(&frame, &state).1;
    }
    assert_eq!(format!("{state:?}"), known);
}

#[test]
fn a_write_after_reads_waits_for_all_of_them_and_flushes_nothing() {
    let barriers = buffer_plan(&[TransferWrite, ComputeRead, IndirectRead, ComputeWrite]);
    let last = barriers[3][0];
    assert_eq!(
        last.src.stage,
        vk::PipelineStageFlags2::COMPUTE_SHADER | vk::PipelineStageFlags2::DRAW_INDIRECT
    );
    assert_eq!(
        (last.src.access, last.dst.access),
        (vk::AccessFlags2::NONE, vk::AccessFlags2::NONE)
    );
}

#[test]
fn neighbouring_mips_share_a_barrier_and_others_are_left_alone() {
    let mips = |first, count, access| {
        vec![Use::image(
            1,
            Span { first, count },
            Span { first: 0, count: 2 },
            access,
        )]
    };
    let (barriers, _) = plan(
        &[
            mips(0, 4, ComputeWrite),
            mips(1, 2, ComputeSampled),
            mips(3, 1, ComputeWrite),
        ],
        &State::default(),
    );
    assert_eq!(barriers.iter().map(Vec::len).collect::<Vec<_>>(), [1, 1, 1]);
    assert_eq!(
        (barriers[1][0].mips, barriers[1][0].layers),
        (Span { first: 1, count: 2 }, Span { first: 0, count: 2 })
    );
    assert_eq!(barriers[2][0].hazard, Hazard::WriteAfterWrite);
}

#[test]
fn state_carries_over_and_forgets_what_is_gone() {
    let write = [vec![Use::buffer(1, ComputeWrite)]];
    let (_, state) = plan(&write, &State::default());
    let read = [vec![Use::buffer(1, ComputeRead)]];
    let (barriers, _) = plan(&read, &state);
    assert_eq!(barriers[0][0].from.unwrap().pass, None);
    let mut state = state;
    state.forget(1);
    assert_eq!(plan(&read, &state).0, [vec![]]);
}

#[test]
#[should_panic(expected = "in two layouts at once")]
fn sampling_and_storing_one_mip_in_one_pass_asserts() {
    let part = |access| Use::image(1, Span::one(0), Span::one(0), access);
    plan(
        &[vec![part(ComputeSampled), part(ComputeWrite)]],
        &State::default(),
    );
}

const BUFFER_WORDS: [Access; 11] = [
    ComputeRead,
    ComputeWrite,
    ComputeReadWrite,
    RasterRead,
    RasterReadWrite,
    IndirectRead,
    Access::IndexRead,
    Access::ConditionRead,
    TransferRead,
    TransferWrite,
    HostRead,
];
const IMAGE_WORDS: [Access; 11] = [
    ComputeRead,
    ComputeWrite,
    ComputeReadWrite,
    ComputeSampled,
    RasterRead,
    RasterReadWrite,
    RasterSampled,
    TransferRead,
    TransferWrite,
    Access::ColorTarget,
    Access::DepthTarget,
];

fn random_passes(random: &mut Random) -> Vec<Vec<Use>> {
    let count = 2 + random.below(10);
    (0..count)
        .map(|_| {
            (0..1 + random.below(3))
                .map(|slot| random_use(random, u64::from(slot)))
                .collect()
        })
        .collect()
}

/// Resources 0 and 1 are buffers, 2 is an image of 4 mips and 2 layers; a pass uses each at most
/// once.
fn random_use(random: &mut Random, resource: u64) -> Use {
    if resource < 2 {
        return Use::buffer(
            resource,
            BUFFER_WORDS[random.below(BUFFER_WORDS.len() as u32) as usize],
        );
    }
    let mut span = |most: u32| {
        let first = random.below(most);
        Span {
            first,
            count: 1 + random.below(most - first),
        }
    };
    let (mips, layers) = (span(4), span(2));
    Use::image(
        resource,
        mips,
        layers,
        IMAGE_WORDS[random.below(IMAGE_WORDS.len() as u32) as usize],
    )
}

#[test]
fn random_frames_are_covered_and_no_barrier_is_spare() {
    let mut random = Random::new(7);
    let mut removed = 0;
    for case in 0..3000 {
        let passes = random_passes(&mut random);
        let (barriers, _) = plan(&passes, &State::default());
        verify(&passes, &barriers)
            .unwrap_or_else(|error| panic!("case {case}: {error}\n{passes:#?}\n{barriers:#?}"));
        let stream = Stream::planned(&passes, &barriers);
        assert_eq!(
            stream.spare_barrier(),
            None,
            "case {case}\n{passes:#?}\n{barriers:#?}"
        );
        removed += stream.barriers().len();
    }
    assert!(
        removed > 10_000,
        "the random frames need barriers: {removed}"
    );
}

#[test]
fn random_frames_cut_in_two_are_covered_by_the_carried_state() {
    let mut random = Random::new(11);
    for case in 0..1000 {
        let passes = random_passes(&mut random);
        let cut = random.below(passes.len() as u32) as usize;
        let (mut barriers, state) = plan(&passes[..cut], &State::default());
        barriers.extend(plan(&passes[cut..], &state).0);
        verify(&passes, &barriers).unwrap_or_else(|error| panic!("case {case}: {error}"));
    }
}

#[test]
fn the_model_notices_each_kind_of_mistake() {
    let passes = [
        vec![Use::buffer(1, ComputeWrite)],
        vec![Use::buffer(1, RasterRead)],
    ];
    let (barriers, _) = plan(&passes, &State::default());
    assert_eq!(verify(&passes, &barriers), Ok(()));
    let broken = |change: fn(&mut Barrier)| {
        let mut barriers = barriers.clone();
        change(&mut barriers[1][0]);
        verify(&passes, &barriers)
    };
    assert!(broken(|barrier| barrier.src.stage = vk::PipelineStageFlags2::DRAW_INDIRECT).is_err());
    assert!(broken(|barrier| barrier.src.access = vk::AccessFlags2::NONE).is_err());
    assert!(broken(|barrier| barrier.dst.stage = vk::PipelineStageFlags2::VERTEX_SHADER).is_err());
    assert!(broken(|barrier| barrier.dst.access = vk::AccessFlags2::SHADER_SAMPLED_READ).is_err());
}

#[test]
fn a_spare_barrier_is_noticed() {
    let passes = [
        vec![Use::buffer(1, ComputeWrite)],
        vec![Use::buffer(1, ComputeRead)],
        vec![Use::buffer(1, ComputeRead)],
    ];
    let (mut barriers, _) = plan(&passes, &State::default());
    assert_eq!(Stream::planned(&passes, &barriers).spare_barrier(), None);
    let again = barriers[1][0];
    barriers[2].push(again);
    assert!(
        Stream::planned(&passes, &barriers)
            .spare_barrier()
            .is_some_and(|text| text.contains("before pass 2"))
    );
}

/// Two copies, the second of what the first wrote, as they would be noted.
fn two_copies() -> JournalFrame {
    let uses = vec![
        vec![Use::buffer(1, ComputeRead), Use::buffer(2, ComputeWrite)],
        vec![Use::buffer(2, ComputeRead), Use::buffer(3, ComputeWrite)],
    ];
    let (barriers, _) = plan(&uses, &State::default());
    let Barrier {
        resource,
        mips,
        layers,
        src,
        dst,
        old_layout,
        new_layout,
        ..
    } = barriers[1][0];
    let pass = |uses: &Vec<Use>| Issued::Pass {
        pass: &COPY,
        touched: uses.iter().map(declared).collect(),
        materials: Vec::new(),
    };
    let barrier = Issued::Barrier(IssuedBarrier {
        resource,
        mips,
        layers,
        src,
        dst,
        old_layout,
        new_layout,
    });
    let issued = vec![pass(&uses[0]), barrier, pass(&uses[1])];
    JournalFrame {
        names: vec!["first".into(), "second".into()],
        uses,
        issued,
    }
}

fn judged(change: impl Fn(&mut JournalFrame)) -> Result<(), String> {
    let mut frame = two_copies();
    change(&mut frame);
    Stream::recorded(&[frame])?.verify()
}

#[test]
fn what_was_recorded_otherwise_than_declared_is_noticed() {
    fn touched(frame: &mut JournalFrame, index: usize) -> &mut Vec<Touch> {
        match &mut frame.issued[index] {
            Issued::Pass { touched, .. } => touched,
            other => panic!("{other:?}"),
        }
    }
    let fails = |change: fn(&mut JournalFrame), expected: &str| {
        let error = judged(change).unwrap_err();
        assert!(error.contains(expected), "{error}");
    };
    assert_eq!(judged(|_| ()), Ok(()));
    fails(|frame| drop(frame.issued.remove(1)), "not ordered");
    fails(|frame| frame.issued.swap(1, 2), "not ordered");
    fails(|frame| frame.issued.truncate(2), "second was not recorded");
    fails(
        |frame| frame.issued.extend(two_copies().issued),
        "more was recorded",
    );
    fails(|frame| frame.uses[0].truncate(1), "do not name");
    fails(
        |frame| touched(frame, 2)[1].used.resource = 4,
        "do not name",
    );
    fails(
        |frame| touched(frame, 2)[1].used.access = ComputeReadWrite,
        "do not name",
    );
    fails(
        |frame| touched(frame, 0)[1].used.mips = Span { first: 0, count: 2 },
        "do not name",
    );
    fails(|frame| touched(frame, 0).truncate(1), "does not reach");
}

/// The textures of materials are named by no step, and played all the same.
#[test]
fn a_material_that_was_not_made_ready_is_noticed() {
    let texture = Use::image(7, Span::one(0), Span::one(0), ComputeSampled);
    let with_material = |ready: bool| {
        judged(|frame| {
            let Issued::Pass { materials, .. } = &mut frame.issued[2] else {
                panic!("a pass")
            };
            materials.extend([declared(&texture); 2]);
            let uses = vec![
                texture,
                Use {
                    access: RasterSampled,
                    ..texture
                },
            ];
            let (barriers, _) = plan(std::slice::from_ref(&uses), &State::default());
            if ready {
                frame.names.insert(0, "ready".into());
                frame.uses.insert(0, uses);
                frame.issued.insert(0, Issued::Nothing);
                let Barrier {
                    resource,
                    mips,
                    layers,
                    src,
                    dst,
                    old_layout,
                    new_layout,
                    ..
                } = barriers[0][0];
                frame.issued.insert(
                    0,
                    Issued::Barrier(IssuedBarrier {
                        resource,
                        mips,
                        layers,
                        src,
                        dst,
                        old_layout,
                        new_layout,
                    }),
                );
            }
        })
    };
    assert_eq!(with_material(true), Ok(()));
    assert!(with_material(false).unwrap_err().contains("in layout"));
}

#[test]
#[should_panic(expected = "pass test.double: it has no SIDES")]
fn a_name_that_a_pass_does_not_have_is_refused() {
    let _ = Frame::new().pass(&DOUBLE).constant("SIDES", 2u32);
}

#[test]
#[should_panic(expected = "pass test.double: WORKGROUP is given twice")]
fn a_name_that_is_given_twice_is_refused() {
    let mut frame = Frame::new();
    let pass = frame.pass(&DOUBLE).constant("WORKGROUP", 64u32);
    let _ = pass.constant("WORKGROUP", 64u32);
}

#[test]
#[should_panic(expected = "pass test.double: values is not given")]
fn a_name_that_is_left_out_is_refused() {
    let mut frame = Frame::new();
    let pass = frame.pass(&DOUBLE).constant("WORKGROUP", 64u32);
    pass.push(&64u32).dispatch([1; 3]);
}

#[test]
fn spread_and_accumulator() {
    assert_eq!(Spread::of(&[]), None);
    assert_eq!(
        Spread::of(&[3.0, 1.0, 2.0]),
        Some(Spread {
            median: 2.0,
            min: 1.0,
            max: 3.0,
            n: 3
        })
    );
    assert_eq!(
        Spread::of(&[4.0, 1.0]),
        Some(Spread {
            median: 2.5,
            min: 1.0,
            max: 4.0,
            n: 2
        })
    );
    let mut times = TimesAccumulator::default();
    for gpu_ms in [1.0, 5.0] {
        times.add(&[PassTime {
            name: "a".into(),
            gpu_ms,
            runs: 1,
        }]);
    }
    let rows = times.rows();
    assert_eq!(
        (rows.len(), rows[0].gpu_ms.median, rows[0].gpu_ms.n),
        (1, 3.0, 2)
    );
}
