//! Light fields of probes against their twins.

use glam::{DVec2, DVec3, IVec2, Vec3};
use lumivox::gi::probes::Lattice;
use lumivox::gi::probes::field::Field;
use lumivox::gi::probes::oracle::{FieldMap, Met, Texel, direction, direction_of, octahedral};
use lumivox::gi::probes::passes::LookupRow;
use lumivox::gi::probes::volume::{Irradiance, Kept, Volume};
use lumivox::gi::shared::paths::PathScene;
use lumivox::graph::{Frame, Gpu};
use lumivox::render::GpuScene;
use lumivox::render::bvh::oracle::RayOracle;
use lumivox::scene::{Material, Scene};

use super::probes::{place_on, scenes};
use super::probes_rooms::add_box;
use crate::support::compare::{Largest, Worst};
use crate::support::passes::{FIELD_RAYS, FieldRayParams};
use crate::support::voxels::half;
use crate::support::{Random, gpu, read_words, words};

/// A scene on the device, and the light fields of probes in it.
struct Fields {
    on_gpu: GpuScene,
    volume: Volume,
    field: Field,
    places: Vec<Vec3>,
}

/// Off the lattice (cells): no ray of a probe runs through an edge of a room.
const ASIDE: Vec3 = Vec3::new(0.013, 0.021, -0.017);

/// As many probes along the longest side, with maps of `edge`² texels, after they have been traced.
fn fields(gpu: &Gpu, scene: &Scene, probes: u32, edge: u32) -> Fields {
    let on_gpu = GpuScene::new(gpu, scene).unwrap();
    let (paths, _) = PathScene::build(gpu, &on_gpu).unwrap();
    let lattice = Lattice::within(on_gpu.bounds, probes, 0.4);
    let kept = Kept {
        irradiance: Irradiance::Harmonics,
        moment_texels: None,
        has_gradients: false,
        bounces: 1,
    };
    let volume = Volume::new(gpu, lattice, &kept).unwrap();
    let aside = lattice.cell() * ASIDE;
    let places: Vec<Vec3> = lattice.places().map(|place| place + aside).collect();
    volume.put(gpu, &places, &[]).unwrap();
    let field = Field::new(gpu, &volume, edge).unwrap();
    let mut frame = Frame::new();
    frame.set_scene(&on_gpu.set, &on_gpu.materials);
    field.trace(&mut frame, &paths.rays, &volume, None);
    gpu.submit(frame).unwrap();
    Fields {
        on_gpu,
        volume,
        field,
        places,
    }
}

fn unpack_seen(packed: u32) -> Option<(f64, DVec3)> {
    let is_there = packed & 0xffff != 0x7c00;
    let distance = half(packed as u16);
    let part = |shift: u32| (f64::from(packed >> shift & 0xff) - 127.0) / 127.0;
    let normal = direction(DVec2::new(part(16), part(24)));
    is_there.then_some((distance, normal))
}

pub(super) fn unpack_rgbe(packed: u32) -> DVec3 {
    let of = |shift: u32| f64::from(packed >> shift & 0xff);
    DVec3::new(of(0), of(8), of(16)) * 2f64.powi((packed >> 24) as i32 - 136)
}

impl Fields {
    /// A word of each texel of a probe's map.
    fn map_words(&self, all: &[u32], probe: u32) -> Vec<u32> {
        let (edge, columns) = (self.field.edge, self.volume.columns);
        let first = [probe % columns * edge, probe / columns * edge];
        let places = (0..edge * edge).map(|at| [first[0] + at % edge, first[1] + at / edge]);
        let words = places.map(|[x, y]| all[(x + y * columns * edge) as usize]);
        words.collect()
    }

    /// The maps as they are on the device.
    fn maps(&self, gpu: &Gpu) -> Vec<FieldMap> {
        let read = |image| -> Vec<u32> {
            bytemuck::pod_collect_to_vec(&gpu.read_image(image, 0, 0).unwrap())
        };
        let (surfaces, radiance) = (read(&self.field.surfaces), read(&self.field.radiance));
        let of = |probe| FieldMap {
            edge: self.field.edge,
            texels: self
                .map_words(&surfaces, probe)
                .into_iter()
                .map(unpack_seen)
                .collect(),
            radiance: self
                .map_words(&radiance, probe)
                .into_iter()
                .map(unpack_rgbe)
                .collect(),
        };
        (0..self.volume.lattice.probe_count()).map(of).collect()
    }

    /// Gives every texel a light of its own.
    fn light_at_random(&self, gpu: &Gpu, random: &mut Random) {
        let [width, height, _] = self.field.radiance.extent(0);
        let exponents = (0..width * height).map(|_| {
            let mantissas = random.next_u32() & 0x00ff_ffff | 0x80;
            mantissas | (126 + random.below(4)) << 24
        });
        let packed: Vec<u32> = exponents.collect();
        gpu.upload_image(&self.field.radiance, 0, 0, bytemuck::cast_slice(&packed))
            .unwrap();
    }

    /// How rays end on the device: how, how far (cells), the light, and their packed origin.
    fn ends(&self, gpu: &Gpu, rays: &[GivenRay], kind: Texel) -> Vec<(Met, f64, DVec3, DVec3)> {
        let floats = rays.iter().flat_map(|ray| {
            let [x, y, z] = ray.origin.to_array();
            let [u, v, w] = ray.direction.to_array();
            [x, y, z, f32::from_bits(ray.probe), u, v, w, ray.begin].map(f32::to_bits)
        });
        let given = words(gpu, "field_rays", &floats.collect::<Vec<u32>>());
        let ends = words(gpu, "ends", &vec![0; 8 * rays.len()]);
        let (most_m, cell_m) = match kind {
            Texel::Plane => (0.5, 1.0),
            Texel::Thickness(most_m, cell_m) => (most_m, cell_m),
        };
        let mut frame = Frame::new();
        frame.set_scene(&self.on_gpu.set, &self.on_gpu.materials);
        frame
            .pass(&FIELD_RAYS)
            .bind("field_rays", &given)
            .bind("ends", &ends)
            .bind("field_surfaces", &self.field.surfaces)
            .bind("field_radiance", &self.field.radiance)
            .constant("FIELD_TEXELS", self.field.edge)
            .constant("THICKNESS_TRACE", kind != Texel::Plane)
            .push(&FieldRayParams {
                lookup: LookupRow {
                    first: [0.0; 4],
                    spacing: [cell_m as f32; 4],
                    counts: [0; 4],
                    columns: self.volume.columns,
                    normal_bias_m: 0.0,
                    weight_floor: 0.0,
                    crush: 0.0,
                },
                thickness_m: most_m as f32,
                count: rays.len() as u32,
            })
            .dispatch([(rays.len() as u32).div_ceil(64), 1, 1]);
        gpu.submit(frame).unwrap();
        let end = |words: &[u32; 8]| {
            let of = |at: usize| f64::from(f32::from_bits(words[at]));
            let met = [Met::Surface, Met::Nothing, Met::Unknown][words[7] as usize];
            let triple = |at: usize| DVec3::new(of(at), of(at + 1), of(at + 2));
            (met, of(3), triple(0), triple(4))
        };
        read_words(gpu, &ends)
            .as_chunks()
            .0
            .iter()
            .map(end)
            .collect()
    }
}

/// A ray in the frame of a probe (cells).
#[derive(Clone, Copy, Debug)]
struct GivenRay {
    probe: u32,
    origin: Vec3,
    direction: Vec3,
    begin: f32,
}

impl GivenRay {
    fn in_f64(&self) -> (DVec3, DVec3) {
        (self.origin.as_dvec3(), self.direction.as_dvec3())
    }
}

fn random_unit(random: &mut Random) -> Vec3 {
    let z = 2.0 * random.unit() - 1.0;
    let (sin, cos) = (std::f32::consts::TAU * random.unit()).sin_cos();
    let r = (1.0 - z * z).max(0.0).sqrt();
    Vec3::new(r * cos, r * sin, z)
}

#[test]
fn texels_see_what_the_reference_sees() {
    let gpu = gpu();
    for scene in scenes() {
        for edge in [16, 21] {
            let fields = fields(&gpu, &scene, 3, edge);
            let (oracle, lattice) = (RayOracle::new(&scene), &fields.volume.lattice);
            let cell = f64::from(lattice.cell());
            // Where a ray passes an edge, its rounding decides.
            let (mut all, mut off) = (0, 0);
            for (probe, map) in (0..).zip(fields.maps(&gpu)) {
                for (at, found) in (0..).zip(&map.texels) {
                    let place = IVec2::new(at % edge as i32, at / edge as i32).as_dvec2() + 0.5;
                    let towards = direction_of(place, edge);
                    let hit =
                        oracle.closest((fields.places[probe as usize], towards.as_vec3(), None));
                    let is_same = match (found, hit) {
                        (None, None) => true,
                        (Some((distance, normal)), Some(hit)) => {
                            let surface =
                                place_on(&scene, (hit.triangle, [0; 2]), towards).geometric_normal;
                            let expected = f64::from(hit.distance) / cell;
                            (distance - expected).abs() < 6e-4 * expected
                                && normal.dot(surface) > 0.9999
                        }
                        _ => false,
                    };
                    all += 1;
                    off += u32::from(!is_same);
                }
            }
            assert!(off * 500 <= all, "{}: {off} of {all} texels", scene.name);
        }
    }
}

#[test]
fn rays_end_where_the_oracle_says() {
    let gpu = gpu();
    let mut random = Random::new(41);
    let mut ends = [0; 3];
    for scene in scenes() {
        for (edge, kind) in [
            (16, Texel::Plane),
            (37, Texel::Plane),
            (32, Texel::Thickness(0.5, 0.7)),
            (19, Texel::Thickness(0.1, 0.2)),
        ] {
            let fields = fields(&gpu, &scene, 2, edge);
            fields.light_at_random(&gpu, &mut random);
            let maps = fields.maps(&gpu);
            let rays: Vec<GivenRay> = (0..4000)
                .map(|number| {
                    let probe = random.below(maps.len() as u32);
                    let far = [0.0, 1e-6, 0.3, 1.0, 3.0][random.below(5) as usize];
                    let mut direction = random_unit(&mut random);
                    // Along axes, and in the planes between octants.
                    if number % 8 == 0 {
                        direction[random.below(3) as usize] = 0.0;
                        direction = direction.normalize();
                    }
                    if number % 32 == 0 {
                        direction = Vec3::AXES[random.below(3) as usize];
                    }
                    GivenRay {
                        probe,
                        origin: far * random_unit(&mut random),
                        direction,
                        begin: [0.0, 0.7][random.below(2) as usize],
                    }
                })
                .collect();
            let mut off = Vec::new();
            for (ray, found) in rays.iter().zip(fields.ends(&gpu, &rays, kind)) {
                let map = &maps[ray.probe as usize];
                let (met, at) = map.march(ray.in_f64(), f64::from(ray.begin), kind);
                ends[met as usize] += 1;
                let is_same = met == found.0
                    && (met == Met::Nothing || (at - found.1).abs() < 1e-3 * (1.0 + at));
                let place = ray.in_f64().0 + found.1 * ray.in_f64().1;
                let light = map.radiance_at(place);
                let is_lit = met != Met::Surface
                    || (found.2 - light).abs().largest() < 2e-2 * light.largest();
                if !is_same || !is_lit {
                    off.push(format!("{ray:?}: {found:?}, not {met:?} at {at}: {light}"));
                }
                let packed = (found.3 - ray.in_f64().0.abs()).abs().largest();
                assert!(
                    packed <= 3.95e-3 * ray.in_f64().0.abs().largest(),
                    "{packed}"
                );
            }
            let what = format!("{}, {edge}² texels, {kind:?}", scene.name);
            assert!(off.len() < 60, "{what}: {}: {:#?}", off.len(), &off[..3]);
        }
    }
    assert!(ends.iter().all(|count| *count > 1000), "{ends:?}");
}

/// A room of 2 m with its front inside, and in it, if asked for, a box of half a metre.
fn room(has_box: bool) -> Scene {
    let mut scene = Scene::default();
    scene.materials.push(Material {
        albedo: Vec3::splat(0.5),
        ..Material::default()
    });
    add_box(&mut scene, Vec3::ZERO, Vec3::splat(2.0), false);
    if has_box {
        add_box(&mut scene, Vec3::splat(0.75), Vec3::splat(1.25), true);
    }
    scene
}

/// In an empty room every ray from a wall meets another where it is, from every probe.
#[test]
fn an_empty_room_has_nothing_unknown() {
    let gpu = gpu();
    let mut random = Random::new(5);
    let scene = room(false);
    for edge in [16, 64] {
        let fields = fields(&gpu, &scene, 2, edge);
        let lattice = &fields.volume.lattice;
        let cell = lattice.cell();
        let rays: Vec<GivenRay> = (0..4000)
            .map(|_| {
                let axis = random.below(3) as usize;
                let mut place = Vec3::from([(); 3].map(|()| 2.0 * random.unit()));
                let is_low = random.below(2) == 0;
                place[axis] = if is_low { 0.0 } else { 2.0 };
                let mut direction = random_unit(&mut random);
                direction[axis] = direction[axis].abs() * if is_low { 1.0 } else { -1.0 };
                let probe = random.below(8);
                let origin = place + 1e-4 * Vec3::AXES[axis] * if is_low { 1.0 } else { -1.0 };
                GivenRay {
                    probe,
                    origin: (origin - fields.places[probe as usize]) / cell,
                    direction,
                    begin: 0.0,
                }
            })
            .collect();
        let (mut far_off, mut unknown) = (0, 0);
        for (ray, (met, at, ..)) in rays.iter().zip(fields.ends(&gpu, &rays, Texel::Plane)) {
            if met != Met::Surface {
                unknown += 1;
                continue;
            }
            let (origin, towards) = (
                ray.origin * cell + fields.places[ray.probe as usize],
                ray.direction,
            );
            let exits = (0..3).map(|axis| {
                let wall = if towards[axis] > 0.0 { 2.0 } else { 0.0 };
                (wall - origin[axis]) / towards[axis]
            });
            let expected = exits.fold(f32::INFINITY, |a, b| if b < a { b } else { a }) / cell;
            let texel = 4.0 / edge as f32 * (ray.origin + expected * towards).length();
            far_off += u32::from((at as f32 - expected).abs() > texel);
        }
        // Beside edges of the room, at a grazing angle, it is further.
        assert!(
            far_off < 120 && unknown < 60,
            "{edge}² texels: {far_off}, {unknown}"
        );
    }
}

/// What is behind a box is where a probe does not see.
#[test]
fn rays_from_behind_a_box_are_unknown() {
    let gpu = gpu();
    let mut random = Random::new(9);
    let fields = fields(&gpu, &room(true), 2, 64);
    let lattice = &fields.volume.lattice;
    let cell = lattice.cell();
    // Probe 0 stands near the corner at the origin; beyond the box, on the way from it, is shade.
    let rays: Vec<GivenRay> = (0..500)
        .map(|_| {
            let place = Vec3::splat(1.4) + 0.1 * random_unit(&mut random);
            GivenRay {
                probe: 0,
                origin: (place - fields.places[0]) / cell,
                direction: random_unit(&mut random),
                begin: 0.0,
            }
        })
        .collect();
    for (ray, (met, at, ..)) in rays.iter().zip(fields.ends(&gpu, &rays, Texel::Plane)) {
        assert_eq!((met, at), (Met::Unknown, 0.0), "{ray:?}");
    }
}

#[test]
fn texels_beyond_a_fold_are_those_of_the_direction() {
    // The oracle's own: a place just beyond an edge falls on the texel that is shown there.
    let map = FieldMap {
        edge: 8,
        texels: vec![None; 64],
        radiance: (0..64).map(|at| DVec3::splat(f64::from(at))).collect(),
    };
    for at in 0..8 {
        let beyond = DVec2::new(8.0 - 1e-6, f64::from(at) + 0.5) * 0.25 - 1.0;
        let light = map.radiance_at(direction(beyond)).x;
        let shown = [8.0 * f64::from(at) + 7.0, 8.0 * f64::from(7 - at) + 7.0];
        let is_shown = shown.iter().any(|shown| (light - shown).abs() < 1e-9);
        assert!(is_shown, "{light}, not one of {shown:?}");
        assert!((octahedral(direction(beyond)) - beyond).abs().largest() < 1e-9);
    }
    let all = map.radiance.iter().map(|light| light.x).worst();
    assert_eq!(all, 63.0);
}
