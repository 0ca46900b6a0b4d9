//! Scenes of every kind of surface, and what compares pixels with all that they may be.

use super::compare::Worst as _;
use super::tolerance::device_class;
use glam::{DVec2, DVec3, Vec2, Vec3};
use lumivox::graph::{Frame, Gpu};
use lumivox::render::oracle::{Scenery, Surface, View};
use lumivox::render::{Follows, FrameConstants, GBuffer, GpuScene};
use lumivox::scene::{
    Camera, Light, Material, Scene, Specular, Texture, TextureKind, Triangle, Vertex,
};

use super::Random;
use super::gather::octahedral;
use super::technique::Builder;
use super::voxels::half;

/// Numbers that a pixel may have, and how far each may be off.
pub type Choice<const N: usize> = ([f64; N], [f64; N]);

/// Distance of a value in tolerances; infinite where one is not a number.
fn off(seen: f64, expected: f64, tolerance: f64) -> f64 {
    let apart = (seen - expected).abs();
    match apart / tolerance {
        _ if apart == 0.0 => 0.0,
        share if share.is_nan() => f64::INFINITY,
        share => share,
    }
}

/// The largest distance of a pixel from the nearest of what it may be, in tolerances, or which
/// pixel is too far from all.
pub fn judge<const N: usize>(seen: &[[f64; N]], allowed: &[Vec<Choice<N>>]) -> Result<f64, String> {
    // At the ends of the image, and where the near plane cuts.
    judge_most(
        seen,
        allowed,
        device_class().allows(0, seen.len().div_ceil(500)),
    )
}

/// The same of all pixels but a few.
fn judge_most<const N: usize>(
    seen: &[[f64; N]],
    allowed: &[Vec<Choice<N>>],
    mut spare: usize,
) -> Result<f64, String> {
    if seen.len() != allowed.len() {
        return Err(format!("{} pixels for {}", seen.len(), allowed.len()));
    }
    let mut worst = 0.0f64;
    for (pixel, (seen, options)) in seen.iter().zip(allowed).enumerate() {
        let distance = |(expected, tolerance): &Choice<N>| {
            (0..N)
                .map(|i| off(seen[i], expected[i], tolerance[i]))
                .worst()
        };
        let nearest = options
            .iter()
            .map(distance)
            .min_by(f64::total_cmp)
            .unwrap_or(f64::INFINITY);
        if nearest > 1.0 && spare > 0 {
            spare -= 1;
            continue;
        }
        if nearest > 1.0 {
            let channels = |(expected, tolerance): &Choice<N>| {
                let wrong: Vec<usize> = (0..N)
                    .filter(|&i| off(seen[i], expected[i], tolerance[i]) > 1.0)
                    .collect();
                format!(
                    "{wrong:?} of {expected:.6?} ± {:.6?}",
                    wrong.iter().map(|&i| tolerance[i]).collect::<Vec<_>>()
                )
            };
            return Err(format!(
                "pixel {pixel} is {seen:.6?}; wrong: {:#?}",
                options.iter().map(channels).collect::<Vec<_>>()
            ));
        }
        worst = worst.max(nearest);
    }
    Ok(worst)
}

/// Plants an error beyond the tolerance, and NaN, in each channel of a pixel that can be only one
/// thing: none may pass. Channels that are allowed to be anything at all are none that a picture
/// can rely on.
pub fn planted_errors_fail<const N: usize>(seen: &[[f64; N]], allowed: &[Vec<Choice<N>>]) {
    for channel in 0..N {
        let fits = |options: &Vec<Choice<N>>| {
            options.len() == 1 && options[0].1[channel].is_finite() && options[0].1[channel] > 0.0
        };
        let pixel = allowed
            .iter()
            .position(fits)
            .unwrap_or_else(|| panic!("no pixel is certain of channel {channel}"));
        for wrong in [
            allowed[pixel][0].0[channel] + 1.5 * allowed[pixel][0].1[channel],
            f64::NAN,
        ] {
            let mut planted = seen.to_vec();
            planted[pixel][channel] = wrong;
            assert!(
                judge_most(&planted, allowed, 0).is_err(),
                "{wrong} in channel {channel} passes"
            );
        }
    }
}

/// Numbers of a G-buffer's pixel: depth, geometric and shading normal, albedo, roughness (−1
/// without a lobe), F0, emission, length of the mean normal.
pub type GBufferPixel = [f64; 18];

/// What a pixel without a surface holds.
pub const NO_SURFACE: GBufferPixel = [0.0; 18];

/// A drawn G-buffer.
pub struct Drawn {
    pub gbuffer: GBuffer,
    pub constants: FrameConstants,
    /// As the camera sees, in f64.
    pub view: View,
}

/// Draws the G-buffer of a scene's own camera.
pub fn draw_gbuffer(gpu: &Gpu, gpu_scene: &GpuScene, scene: &Scene, size: [u32; 2]) -> Drawn {
    let constants = gpu_scene.frame_constants(&scene.camera, size);
    gpu_scene.set_frame(gpu, &constants).unwrap();
    let gbuffer = GBuffer::new(gpu, gpu_scene, size, Follows::Nothing).unwrap();
    let mut frame = Frame::new();
    frame.set_scene(&gpu_scene.set, &gpu_scene.materials);
    gbuffer.draw(&mut frame, gpu_scene);
    gpu.submit(frame).unwrap();
    let (low, high) = gpu_scene.bounds;
    let view = View::of_camera(&scene.camera, size, 1e-4 * f64::from((high - low).length()));
    Drawn {
        gbuffer,
        constants,
        view,
    }
}

impl Drawn {
    /// Reads every channel of every pixel.
    pub fn read(&self, gpu: &Gpu) -> Vec<GBufferPixel> {
        let bytes =
            |image: &std::sync::Arc<lumivox::graph::Image>| gpu.read_image(image, 0, 0).unwrap();
        let depth: Vec<f32> = bytemuck::pod_collect_to_vec(&bytes(&self.gbuffer.view_depth));
        let normals: Vec<[u32; 2]> = bytemuck::pod_collect_to_vec(&bytes(&self.gbuffer.normals));
        let albedo: Vec<[u16; 4]> = bytemuck::pod_collect_to_vec(&bytes(&self.gbuffer.albedo));
        let specular: Option<Vec<[u16; 4]>> = self
            .gbuffer
            .specular
            .as_ref()
            .map(|image| bytemuck::pod_collect_to_vec(&bytes(image)));
        let emission: Option<Vec<[f32; 4]>> = self
            .gbuffer
            .emission
            .as_ref()
            .map(|image| bytemuck::pod_collect_to_vec(&bytes(image)));
        let pixel = |at: usize| {
            let is_surface = depth[at] != 0.0;
            let [geometric, shading] = normals[at].map(|packed| {
                if is_surface {
                    octahedral(packed)
                } else {
                    DVec3::splat(f64::from(packed))
                }
            });
            let [r, g, b, length] = albedo[at].map(half);
            let no_lobe = [0.0, 0.0, 0.0, if is_surface { -1.0 } else { 0.0 }];
            let [x, y, z, roughness] = specular
                .as_ref()
                .map_or(no_lobe, |image| image[at].map(half));
            let glow = emission
                .as_ref()
                .map_or([0.0; 3], |image| [0, 1, 2].map(|i| f64::from(image[at][i])));
            let [albedo, f0] = [DVec3::new(r, g, b), DVec3::new(x, y, z)];
            flat(
                f64::from(depth[at]),
                [geometric, shading, albedo, f0, glow.into()],
                [roughness, length],
            )
        };
        (0..depth.len()).map(pixel).collect()
    }
}

/// Geometric and shading normal, albedo, F0, emission; roughness, length of the mean normal.
fn flat(
    depth: f64,
    [geometric, shading, albedo, f0, emission]: [DVec3; 5],
    [roughness, length]: [f64; 2],
) -> GBufferPixel {
    let mut all = [0.0; 18];
    all[0] = depth;
    all[10] = roughness;
    all[17] = length;
    for (first, vector) in [
        (1, geometric),
        (4, shading),
        (7, albedo),
        (11, f0),
        (14, emission),
    ] {
        all[first..first + 3].copy_from_slice(&vector.to_array());
    }
    all
}

/// The numbers that a surface is kept by, where a normal map's texels do not differ in a pixel.
pub fn gbuffer_pixel(surface: &Surface) -> GBufferPixel {
    let Surface {
        depth_m,
        geometric_normal,
        shading_normal,
        albedo,
        roughness,
        f0,
        emission,
        ..
    } = *surface;
    flat(
        depth_m,
        [geometric_normal, shading_normal, albedo, f0, emission],
        [roughness.unwrap_or(-1.0), 1.0],
    )
}

/// Where in a picture (px) a pixel's centre is.
pub fn centre(pixel: usize, size: [u32; 2]) -> DVec2 {
    DVec2::new(
        (pixel as u32 % size[0]).into(),
        (pixel as u32 / size[0]).into(),
    ) + 0.5
}

/// Random texels.
pub fn texture(name: &str, kind: TextureKind, size: u32, random: &mut Random) -> Texture {
    let texel = |random: &mut Random| match kind {
        TextureKind::Color => [0; 4].map(|_: u8| random.below(256) as u8),
        TextureKind::Mask => [if random.below(2) == 0 { 0 } else { 255 }; 4],
        TextureKind::Normal => {
            let (x, y) = (2.0 * random.unit() - 1.0, 2.0 * random.unit() - 1.0);
            let unit = Vec3::new(x, y, 0.6).normalize();
            let [r, g, b] = unit
                .to_array()
                .map(|x| ((0.5 * x + 0.5) * 255.0).round() as u8);
            [r, g, b, 255]
        }
    };
    Texture {
        name: name.into(),
        kind,
        width: size,
        height: size,
        texels: (0..size * size).map(|_| texel(random)).collect(),
    }
}

/// The scene with the lobe of each material in a texture. Each has two texels, of which the first
/// has the factors of before; the other is of another lobe, and no surface is there.
pub fn with_lobe_textures(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    for triangle in &scene.triangles {
        if scene.materials[triangle.material as usize]
            .specular
            .is_some()
        {
            for vertex in triangle.vertices {
                let vertex = &mut scene.vertices[vertex as usize];
                (vertex.u, vertex.v) = (0.25, 0.5);
            }
        }
    }
    for material in &mut scene.materials {
        let Some(lobe) = &mut material.specular else {
            continue;
        };
        // A texel of the colour that is nearest, and what is missing as a factor.
        let texel = [128u8, 200, 255, 230];
        let linear = |value: u8| ((f32::from(value) / 255.0 + 0.055) / 1.055).powf(2.4);
        let [r, g, b] = [texel[0], texel[1], texel[2]].map(linear);
        *lobe = Specular {
            f0: lobe.f0 / Vec3::new(r, g, b),
            roughness: lobe.roughness / (f32::from(texel[3]) / 255.0),
            texture: Some(scene.textures.len() as u32),
            ..*lobe
        };
        scene.textures.push(
            Texture {
                name: "lobe".into(),
                kind: TextureKind::Color,
                width: 2,
                height: 1,
                texels: vec![texel, [0, 0, 0, 20]],
            }
            .into(),
        );
    }
    scene
}

/// Adds a parallelogram with its own texture coordinates, whose normals lean outwards by `bend`.
pub fn sheet(
    builder: &mut Builder,
    material: u32,
    [corner, a, b]: [Vec3; 3],
    uv: [Vec2; 4],
    bend: f32,
) {
    builder.quad(material, corner, a, b);
    let first = builder.scene.vertices.len() - 4;
    let middle = corner + 0.5 * (a + b);
    for (vertex, uv) in builder.scene.vertices[first..].iter_mut().zip(uv) {
        (vertex.u, vertex.v) = (uv.x, uv.y);
        let outwards = bend * (Vec3::from(vertex.position) - middle);
        vertex.normal = (Vec3::from(vertex.normal) + outwards)
            .normalize()
            .to_array();
    }
}

/// A room with every kind of surface: textures, normal maps, mirrored and turned texture
/// coordinates, bent normals, normals on the wrong side, masks, triangles without area, and where
/// asked for glossy ones, with and without a texture of the lobe, and emissive ones.
pub fn every_surface(glossy: bool, emissive: bool) -> Scene {
    let mut builder = Builder::default();
    let mut random = Random::new(17);
    let textures = [
        ("color", TextureKind::Color, 8),
        ("mask", TextureKind::Mask, 4),
        ("bumps", TextureKind::Normal, 4),
        ("glow", TextureKind::Color, 4),
        ("lobe", TextureKind::Color, 8),
    ];
    builder.scene.textures = textures
        .map(|(name, kind, size)| texture(name, kind, size, &mut random).into())
        .to_vec();
    let plain = Material {
        albedo: Vec3::new(0.7, 0.6, 0.5),
        ..Material::default()
    };
    let lobe = |f0: f32, roughness, metalness| {
        glossy.then_some(Specular {
            f0: Vec3::new(f0, 0.5 * f0, 0.04),
            roughness,
            metalness,
            texture: None,
        })
    };
    let glow = |r: f32| {
        if emissive {
            Vec3::new(r, 2.0, 0.25)
        } else {
            Vec3::ZERO
        }
    };
    let mut add = |material: Material| builder.material(material);
    let wall = add(plain.clone());
    let floor = add(Material {
        albedo: Vec3::new(0.9, 0.8, 0.7),
        albedo_texture: Some(0),
        ..plain.clone()
    });
    let bumpy = add(Material {
        albedo_texture: Some(0),
        normal_texture: Some(2),
        specular: lobe(0.3, 0.9, 0.5).map(|lobe| Specular {
            texture: Some(4),
            ..lobe
        }),
        ..plain.clone()
    });
    let turned = add(Material {
        albedo: Vec3::new(0.2, 0.3, 0.9),
        normal_texture: Some(2),
        ..plain.clone()
    });
    let masked = add(Material {
        albedo: Vec3::new(0.1, 0.7, 0.3),
        mask_texture: Some(1),
        specular: lobe(0.1, 0.6, 0.0),
        ..plain.clone()
    });
    let block = add(Material {
        albedo: Vec3::new(0.95, 0.6, 0.2),
        specular: lobe(0.05, 0.1, 1.0),
        ..plain.clone()
    });
    let lamp = add(Material {
        albedo: Vec3::splat(0.25),
        emission: glow(3.0),
        emission_texture: Some(3),
        ..plain.clone()
    });
    let lamp_behind = add(Material {
        albedo: Vec3::splat(0.35),
        emission: glow(1.0),
        ..plain
    });
    let low = Vec3::new(-1.0, 0.0, -1.0);
    let square = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
    let mirrored = [
        Vec2::new(1.25, -0.25),
        Vec2::new(0.0, -0.25),
        Vec2::new(0.0, 0.5),
        Vec2::new(1.25, 0.5),
    ];
    let skewed = [
        Vec2::new(0.1, 0.9),
        Vec2::new(-0.4, 0.2),
        Vec2::new(0.5, -0.3),
        Vec2::new(1.0, 0.4),
    ];
    builder.quad(wall, low, Vec3::Y * 2.0, Vec3::Z * 2.0);
    builder.quad(wall, low + Vec3::X * 2.0, Vec3::Z * 2.0, Vec3::Y * 2.0);
    builder.quad(wall, low + Vec3::Y * 2.0, Vec3::X * 2.0, Vec3::Z * 2.0);
    builder.quad(floor, low, Vec3::Z * 2.0, Vec3::X * 2.0);
    sheet(
        &mut builder,
        bumpy,
        [low, Vec3::X * 2.0, Vec3::Y * 2.0],
        mirrored,
        0.0,
    );
    // So bent, and with bumps so steep, that some normals come out below the surface.
    sheet(
        &mut builder,
        turned,
        [
            Vec3::new(-0.8, 0.9, -0.3),
            Vec3::new(0.7, 0.1, 0.2),
            Vec3::new(-0.1, 0.8, 0.1),
        ],
        skewed,
        1.8,
    );
    sheet(
        &mut builder,
        turned,
        [
            Vec3::new(0.97, 0.2, 0.6),
            Vec3::new(-0.2, 0.0, -0.9),
            Vec3::new(0.0, 0.8, 0.0),
        ],
        square,
        0.2,
    );
    let first = builder.scene.vertices.len() - 4;
    builder.scene.vertices[first..]
        .iter_mut()
        .for_each(|vertex| vertex.normal = vertex.normal.map(|x| -x));
    sheet(
        &mut builder,
        masked,
        [
            Vec3::new(0.0, 0.35, 0.45),
            Vec3::new(0.8, 0.0, -0.1),
            Vec3::new(0.0, 0.7, 0.1),
        ],
        square,
        0.3,
    );
    builder.cuboid(block, Vec3::new(-0.6, 0.0, -0.1), Vec3::new(-0.1, 0.6, 0.4));
    sheet(
        &mut builder,
        lamp,
        [
            Vec3::new(0.1, 1.25, 0.1),
            Vec3::new(0.6, 0.05, 0.0),
            Vec3::new(0.0, 0.5, 0.1),
        ],
        square,
        0.0,
    );
    sheet(
        &mut builder,
        lamp_behind,
        [
            Vec3::new(0.9, 1.2, 0.2),
            Vec3::new(-0.15, 0.0, 0.3),
            Vec3::new(0.0, 0.6, 0.0),
        ],
        square,
        0.0,
    );
    without_area(&mut builder, wall);
    let camera = Camera {
        eye: Vec3::new(0.13, 1.07, 3.3),
        target: Vec3::new(-0.02, 0.97, 0.0),
        up: Vec3::Y,
        vfov_deg: 42.0,
    };
    builder.finish("every-surface", Vec::new(), Vec3::ZERO, camera)
}

/// Triangles that have no area, or next to none, before everything else.
fn without_area(builder: &mut Builder, material: u32) {
    let at = Vec3::new(0.05, 0.8, 1.2);
    let far = Vec3::new(0.7, 1.3, 1.4);
    for corners in [
        [at; 3],
        [at, at, far],
        [at, far, 0.5 * (at + far)],
        [at, far, far + Vec3::X * 1e-12],
        [at, far, far + Vec3::X * 1e-6],
    ] {
        let first = builder.scene.vertices.len() as u32;
        builder.scene.vertices.extend(corners.map(|corner| Vertex {
            position: corner.to_array(),
            u: 0.0,
            normal: [0.0, 0.0, 1.0],
            v: 0.0,
        }));
        builder.scene.triangles.push(Triangle {
            vertices: [first, first + 1, first + 2],
            material,
        });
    }
}

/// The same scene, seen from elsewhere.
pub fn seen_from(scene: Scene, eye: [f32; 3], target: [f32; 3], vfov_deg: f32) -> Scene {
    Scene {
        camera: Camera {
            eye: eye.into(),
            target: target.into(),
            up: Vec3::Y,
            vfov_deg,
        },
        ..scene
    }
}

/// The same scene under other lights.
pub fn lit_by(scene: Scene, lights: Vec<Light>) -> Scene {
    Scene { lights, ..scene }
}

/// What a scene's triangles are to the oracle at the centre of each pixel: all that it may be,
/// within `tolerance` and what 1/64 px aside would make of it. Channels that tolerate anything are
/// infinite in `tolerance`.
pub fn allowed<const N: usize>(
    scenery: &Scenery<'_>,
    view: &View,
    empty: [f64; N],
    of: impl Fn(usize, DVec2) -> Option<[f64; N]> + Sync,
    tolerance: impl Fn(usize, DVec2, &[f64; N]) -> [f64; N] + Sync,
) -> Vec<Vec<Choice<N>>> {
    use rayon::prelude::*;
    let options = |pixel: usize| {
        let at = centre(pixel, view.size);
        let seen = scenery.seen(view, at);
        let option = |&triangle: &usize| {
            let expected = of(triangle, at)?;
            let mut tolerance = tolerance(triangle, at, &expected);
            for aside in lumivox::render::oracle::corners_around(at, 1.0 / 64.0) {
                let other = of(triangle, aside)?;
                (0..N).for_each(|i| tolerance[i] += (other[i] - expected[i]).abs());
            }
            Some((expected, tolerance))
        };
        let nothing = seen.may_be_empty.then_some((empty, [0.0; N]));
        seen.triangles
            .iter()
            .filter_map(option)
            .chain(nothing)
            .collect()
    };
    (0..(view.size[0] * view.size[1]) as usize)
        .into_par_iter()
        .map(options)
        .collect()
}

/// Share of pixels that may be more than one thing.
pub fn undecided<const N: usize>(allowed: &[Vec<Choice<N>>]) -> f64 {
    allowed.iter().filter(|options| options.len() != 1).count() as f64 / allowed.len() as f64
}
