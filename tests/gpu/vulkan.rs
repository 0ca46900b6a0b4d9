//! Small passes on a device, with validation.

use std::sync::Arc;

use crate::support::passes::{COLOR, COPY, COUNT, DOUBLE, MATERIAL, SAMPLE, STORE};
use crate::support::{Missing, gpu, read_words, skipped, words};
use lumivox::graph::plan::Hazard;
use lumivox::graph::{
    BatchDispatch, BufferDesc, BufferUsage, ClearOrLoad, DeviceChoice, DrawBatch, Error, Frame,
    FrameStats, Gpu, GpuOptions, Image, ImageDesc, ImageKind, ImageUsage, MATERIAL_TEXTURES, Owner,
    SceneBindings, SceneSet, Targets, vk,
};

fn image(
    gpu: &Gpu,
    name: &str,
    extent: [u32; 3],
    kind: ImageKind,
    format: vk::Format,
    mips: u32,
    usage: ImageUsage,
) -> Arc<Image> {
    gpu.create_image(&ImageDesc {
        name: name.into(),
        extent,
        kind,
        format,
        mips,
        layers: 1,
        usage,
        owner: Owner::Shared,
    })
    .unwrap()
}

fn floats(bytes: &[u8]) -> Vec<f32> {
    bytes
        .as_chunks()
        .0
        .iter()
        .map(|word| f32::from_le_bytes(*word))
        .collect()
}

fn empty_scene(gpu: &Gpu) -> Arc<SceneSet> {
    let frame_uniform = gpu
        .create_buffer(&BufferDesc {
            name: "frame".into(),
            size_bytes: 256,
            usage: BufferUsage::Uniform,
            owner: Owner::Shared,
        })
        .unwrap();
    let storage = |name| words(gpu, name, &[0; 16]);
    let sky = gpu
        .create_image(&ImageDesc {
            name: "sky".into(),
            extent: [1; 3],
            kind: ImageKind::D2,
            format: vk::Format::R16G16B16A16_SFLOAT,
            mips: 1,
            layers: 1,
            usage: ImageUsage::SAMPLED,
            owner: Owner::Shared,
        })
        .unwrap();
    gpu.make_ready(&[&sky]);
    let bindings = SceneBindings {
        frame_uniform,
        positions: storage("positions"),
        normals: storage("normals"),
        uvs: storage("uvs"),
        triangle_vertices: storage("triangle_vertices"),
        triangle_materials: storage("triangle_materials"),
        materials: storage("materials"),
        lights: storage("lights"),
        sky,
        clear_shadows: storage("clear_shadows"),
        has_clear_shadows: false,
        has_cascades: false,
        has_textures: false,
        has_lobe_textures: false,
    };
    gpu.create_scene_set(&bindings).unwrap()
}

/// Frames that wait for a submission run before it, and are told, even where that only reads.
#[test]
fn what_waits_runs_first_and_is_told_once() {
    let gpu = gpu();
    let buffer = words(&gpu, "values", &[1, 2, 3]);
    let doubled = || {
        let mut frame = Frame::new();
        frame
            .pass(&DOUBLE)
            .bind("values", &buffer)
            .constant("WORKGROUP", 64u32)
            .push(&3u32)
            .dispatch([1, 1, 1]);
        frame
    };
    gpu.enqueue(doubled());
    gpu.enqueue(doubled());
    let before = gpu.host_work();
    assert_eq!(read_words(&gpu, &buffer), [7, 11, 15]);
    assert_eq!(gpu.host_work().since(before).submissions, 1);
    let told = gpu.submit(doubled()).unwrap();
    assert_eq!(told.passes[0].runs, 3, "{told:?}");
    assert_eq!(gpu.submit_waiting().unwrap(), FrameStats::default());
    gpu.submit_ahead(doubled()).unwrap();
    gpu.enqueue(doubled());
    gpu.submit_ahead(doubled()).unwrap();
    gpu.submit_ahead(doubled()).unwrap();
    let told = gpu.finish().unwrap();
    let runs: Vec<u32> = told.iter().map(|stats| stats.passes[0].runs).collect();
    assert_eq!(runs, [1, 2, 1]);
    let expected = [1, 2, 3].map(|value: u32| 128 * value + 127);
    assert_eq!(read_words(&gpu, &buffer), expected);
}

#[test]
fn dispatch_doubles_any_number_of_elements() {
    let gpu = gpu();
    for count in [0u32, 1, 63, 64, 65] {
        let input: Vec<u32> = (0..count).collect();
        let buffer = words(&gpu, "values", &input);
        let mut frame = Frame::new();
        for _ in 0..2 {
            frame
                .pass(&DOUBLE)
                .bind("values", &buffer)
                .constant("WORKGROUP", 64u32)
                .push(&count)
                .dispatch([count.div_ceil(64), 1, 1]);
        }
        let stats = gpu.submit(frame).unwrap();
        assert_eq!(
            read_words(&gpu, &buffer),
            input.iter().map(|value| 4 * value + 3).collect::<Vec<_>>()
        );
        assert_eq!(
            (
                stats.passes.len(),
                stats.passes[0].name.as_str(),
                stats.passes[0].runs
            ),
            (1, "test.double", 2)
        );
    }
}

#[test]
fn indirect_dispatch_reads_its_arguments_after_they_are_written() {
    let gpu = gpu();
    let (arguments, source) = (
        words(&gpu, "arguments", &[0; 3]),
        words(&gpu, "source", &[2, 1, 1]),
    );
    let values = words(&gpu, "values", &[5; 128]);
    let mut frame = Frame::new();
    frame
        .pass(&COPY)
        .bind("source", &source)
        .bind("target", &arguments)
        .push(&3u32)
        .dispatch([1, 1, 1]);
    frame
        .pass(&DOUBLE)
        .bind("values", &values)
        .constant("WORKGROUP", 64u32)
        .push(&128u32)
        .dispatch_indirect(&arguments, 0);
    gpu.submit(frame).unwrap();
    assert_eq!(read_words(&gpu, &values), [11; 128]);
}

#[test]
fn fills_and_copies_go_where_they_are_told() {
    let gpu = gpu();
    let (source, target) = (
        words(&gpu, "source", &[0; 8]),
        words(&gpu, "target", &[9; 8]),
    );
    let mut frame = Frame::new();
    frame.fill("fill", &source, 7);
    frame.copy_buffer("copy", (&source, 4), (&target, 8), 12);
    gpu.submit(frame).unwrap();
    assert_eq!(read_words(&gpu, &target), [9, 9, 7, 7, 7, 9, 9, 9]);
}

#[test]
fn raster_pass_without_attachments_counts_every_fragment() {
    let gpu = gpu();
    if !gpu.features().geometry_shader {
        skipped(&Missing::Other("no geometry shaders on this device"));
        return;
    }
    let counts = image(
        &gpu,
        "counts",
        [16, 16, 2],
        ImageKind::D3,
        vk::Format::R32_UINT,
        1,
        ImageUsage::STORAGE,
    );
    let mut frame = Frame::new();
    frame.clear_image("counts.clear", &counts, 0u32);
    let quad = DrawBatch {
        vertex_count: 6,
        ..DrawBatch::default()
    };
    frame
        .pass(&COUNT)
        .bind("counts", &counts)
        .draw(Targets::none([16, 16]), vec![quad.clone(), quad]);
    gpu.submit(frame).unwrap();
    let bytes = gpu.read_image(&counts, 0, 0).unwrap();
    let texels: Vec<u32> = bytes
        .as_chunks()
        .0
        .iter()
        .map(|word| u32::from_le_bytes(*word))
        .collect();
    let (first, second) = texels.split_at(256);
    assert!(
        first.iter().zip(second).all(|(a, b)| a + b == 2),
        "each pixel is covered once by each quad"
    );
}

#[test]
fn blit_halves_a_volume_and_samplers_see_every_mip() {
    let gpu = gpu();
    let volume = image(
        &gpu,
        "volume",
        [8; 3],
        ImageKind::D3,
        vk::Format::R16G16B16A16_SFLOAT,
        4,
        ImageUsage::STORAGE | ImageUsage::SAMPLED,
    );
    let (scene, target) = (empty_scene(&gpu), words(&gpu, "target", &[0; 16]));
    for _ in 0..2 {
        let mut frame = Frame::new();
        frame.set_scene(&scene, &Arc::from([]));
        frame.pass(&STORE).bind("volume", &volume).dispatch([2; 3]);
        frame.blit_mips("volume.mips", &volume);
        frame
            .pass(&SAMPLE)
            .bind("volume", &volume)
            .bind("target", &target)
            .dispatch([4, 1, 1]);
        let stats = gpu.submit(frame).unwrap();
        assert_eq!(stats.passes[1].runs, 3);
        assert_eq!(
            floats(&gpu.read_buffer(&target).unwrap()),
            [3.5, 1.0, 0.0, 1.0].repeat(4)
        );
    }
}

#[test]
fn draws_reach_the_colour_target_and_depth_rejects_the_second() {
    let gpu = gpu();
    let color = image(
        &gpu,
        "color",
        [8, 4, 1],
        ImageKind::D2,
        vk::Format::R32G32B32A32_SFLOAT,
        1,
        ImageUsage::COLOR,
    );
    let depth = image(
        &gpu,
        "depth",
        [8, 4, 1],
        ImageKind::D2,
        vk::Format::D32_SFLOAT,
        1,
        ImageUsage::DEPTH | ImageUsage::SAMPLED,
    );
    let push = |value: [f32; 4]| bytemuck::bytes_of(&value).to_vec();
    let batch = |value, vertex_count| DrawBatch {
        push: push(value),
        vertex_count,
        ..DrawBatch::default()
    };
    let mut frame = Frame::new();
    let clear = ClearOrLoad::Clear([1.0; 4]);
    let targets = Targets {
        color: &[(&color, 0, 0, clear)],
        depth: Some((&depth, 0, clear)),
        extent: [8, 4],
        viewport: None,
    };
    frame.pass(&COLOR).draw(
        targets,
        vec![batch([0.25, 0.5, 0.75, 1.0], 6), batch([9.0; 4], 6)],
    );
    gpu.submit(frame).unwrap();
    assert_eq!(
        floats(&gpu.read_image(&color, 0, 0).unwrap()),
        [0.25, 0.5, 0.75, 1.0].repeat(32)
    );
    assert_eq!(floats(&gpu.read_image(&depth, 0, 0).unwrap()), [0.5; 32]);
}

#[test]
fn uploads_come_back() {
    let gpu = gpu();
    let texels: Vec<u8> = (0..64).collect();
    let picture = image(
        &gpu,
        "picture",
        [4, 4, 1],
        ImageKind::D2,
        vk::Format::R8G8B8A8_SRGB,
        3,
        ImageUsage::SAMPLED,
    );
    gpu.upload_image(&picture, 0, 0, &texels).unwrap();
    let mut frame = Frame::new();
    frame.blit_mips("picture.mips", &picture);
    gpu.submit(frame).unwrap();
    let materials = gpu
        .create_material_set([&picture; MATERIAL_TEXTURES])
        .unwrap();
    assert_eq!(gpu.read_image(&picture, 0, 0).unwrap(), texels);
    drop(materials);
}

#[test]
fn each_batch_sees_its_own_material() {
    let gpu = gpu();
    let (scene, target) = (empty_scene(&gpu), words(&gpu, "target", &[0; 8]));
    let material = |value: u8| {
        let albedo = image(
            &gpu,
            "albedo",
            [1; 3],
            ImageKind::D2,
            vk::Format::R8G8B8A8_UNORM,
            1,
            ImageUsage::SAMPLED,
        );
        gpu.upload_image(&albedo, 0, 0, &[value; 4]).unwrap();
        gpu.create_material_set([&albedo; MATERIAL_TEXTURES])
            .unwrap()
    };
    let mut frame = Frame::new();
    frame.set_scene(&scene, &Arc::from([material(255), material(0)]));
    let batch = |material: u32| BatchDispatch {
        material,
        push: bytemuck::bytes_of(&material).to_vec(),
        groups: [1; 3],
    };
    frame
        .pass(&MATERIAL)
        .bind("target", &target)
        .dispatch_batches(vec![batch(1), batch(0)]);
    gpu.submit(frame).unwrap();
    assert_eq!(
        floats(&gpu.read_buffer(&target).unwrap()),
        [[1.0; 4], [0.0; 4]].concat()
    );
}

#[test]
fn synchronization_validation_reports_a_barrier_left_out() {
    let gpu = gpu();
    let [a, b, c] = ["a", "b", "c"].map(|name| words(&gpu, name, &[1; 64]));
    let frame = || {
        let mut frame = Frame::new();
        frame
            .pass(&COPY)
            .bind("source", &a)
            .bind("target", &b)
            .push(&64u32)
            .dispatch([1, 1, 1]);
        frame
            .pass(&COPY)
            .bind("source", &b)
            .bind("target", &c)
            .push(&64u32)
            .dispatch([1, 1, 1]);
        frame
    };
    gpu.submit(frame()).unwrap();
    assert_eq!(gpu.validation_messages(), Vec::<String>::new());
    gpu.submit_with_barriers(frame(), |barrier| barrier.hazard != Hazard::ReadAfterWrite)
        .unwrap();
    let messages = gpu.messages().take();
    assert!(
        messages
            .iter()
            .any(|message| message.contains("SYNC-HAZARD-READ-AFTER-WRITE")),
        "{messages:?}"
    );
}

#[test]
fn memory_is_named_counted_and_given_back() {
    let gpu = gpu();
    assert_eq!(gpu.memory_total(), 0);
    let buffer = words(&gpu, "values", &[1; 1024]);
    let memory = gpu.memory();
    assert_eq!((memory.len(), memory[0].0.as_str()), (1, "values"));
    assert!(gpu.memory_total() >= 4096);
    let of = |owner| gpu.bytes_of(owner);
    assert_eq!(of(Owner::Shared), memory[0].1);
    assert_eq!([of(Owner::Store), of(Owner::Screen)], [0; 2]);
    drop(buffer);
    assert_eq!((gpu.memory(), of(Owner::Shared)), (vec![], 0));
}

/// What the check of a device that comes back stands on: resources by name, and objects without
/// memory by number.
#[test]
fn a_leak_is_seen() {
    let gpu = gpu();
    assert_eq!(gpu.residue(), Vec::<String>::new());
    let (buffer, set) = (words(&gpu, "values", &[1; 16]), empty_scene(&gpu));
    let left = gpu.residue();
    assert!(
        left[0].starts_with("values, ")
            && left.len() == 12
            && left[11].contains("objects without memory"),
        "{left:?}"
    );
    drop(set);
    assert_eq!(gpu.residue().len(), 1);
    drop(buffer);
    let mut frame = Frame::new();
    let buffer = words(&gpu, "values", &[1; 64]);
    frame
        .pass(&DOUBLE)
        .bind("values", &buffer)
        .constant("WORKGROUP", 64u32)
        .push(&64u32)
        .dispatch([1, 1, 1]);
    gpu.submit(frame).unwrap();
    drop(buffer);
    // A pipeline that was made is not a leak.
    assert_eq!(gpu.residue(), Vec::<String>::new());
}

#[test]
fn what_cannot_fit_is_an_error_with_the_numbers() {
    let gpu = gpu();
    let wanted = gpu.limits().storage_buffer_bytes + 4;
    let desc = |size_bytes, usage| BufferDesc {
        name: "svo.nodes".into(),
        size_bytes,
        usage,
        owner: Owner::Shared,
    };
    let error = gpu
        .create_buffer(&desc(wanted, BufferUsage::Storage))
        .err()
        .unwrap();
    let text = error.to_string();
    assert!(matches!(error, Error::TooLarge { .. }));
    assert!(
        text.contains("svo.nodes")
            && text.contains(&wanted.to_string())
            && text.contains(&(wanted - 4).to_string()),
        "{text}"
    );
    let error = gpu
        .create_buffer(&desc(gpu.limits().heap_bytes + 1, BufferUsage::Readback))
        .err()
        .unwrap();
    assert!(
        matches!(error, Error::TooLarge { .. } | Error::OutOfMemory { .. }),
        "{error}"
    );
    let volume = |extent| ImageDesc {
        name: "volume".into(),
        extent: [extent; 3],
        kind: ImageKind::D3,
        format: vk::Format::R16G16B16A16_SFLOAT,
        mips: 1,
        layers: 1,
        usage: ImageUsage::STORAGE,
        owner: Owner::Shared,
    };
    let error = gpu
        .create_image(&volume(gpu.limits().extent_3d + 1))
        .err()
        .unwrap();
    assert!(matches!(error, Error::ImageTooLarge { .. }), "{error}");
    let error = gpu
        .create_image(&volume(gpu.limits().extent_3d))
        .err()
        .unwrap();
    assert!(
        matches!(error, Error::TooLarge { .. } | Error::OutOfMemory { .. }),
        "{error}"
    );
}

#[test]
fn device_choices_that_match_nothing_say_what_there_is() {
    let open = |device| {
        Gpu::new(&GpuOptions {
            device,
            ..GpuOptions::default()
        })
        .err()
        .unwrap()
    };
    let error = open(DeviceChoice::Name("no such card".into())).to_string();
    assert!(
        error.contains("no such card") && error.contains("[0]"),
        "{error}"
    );
    assert!(matches!(
        open(DeviceChoice::Index(99)),
        Error::DeviceNotFound { .. }
    ));
}

#[test]
#[should_panic(expected = "pass test.copy: values cannot be bound as source")]
fn binding_the_wrong_kind_asserts_with_the_names() {
    let gpu = gpu();
    let volume = image(
        &gpu,
        "values",
        [4; 3],
        ImageKind::D3,
        vk::Format::R32_UINT,
        1,
        ImageUsage::STORAGE,
    );
    let _ = Frame::new().pass(&COPY).bind("source", &volume);
}

#[test]
#[should_panic(expected = "pass test.copy: it has no values")]
fn binding_what_a_pass_does_not_have_asserts_with_the_name() {
    let gpu = gpu();
    let values = words(&gpu, "values", &[1; 4]);
    let _ = Frame::new().pass(&COPY).bind("values", &values);
}

#[test]
#[should_panic(expected = "pass test.double: WORKGROUP is not given")]
fn a_pass_without_one_of_its_constants_asserts_with_the_name() {
    let gpu = gpu();
    let values = words(&gpu, "values", &[1; 4]);
    let mut frame = Frame::new();
    let pass = frame.pass(&DOUBLE).bind("values", &values);
    pass.push(&4u32).dispatch([1; 3]);
}
