//! Where pixels are too far apart to share light, as a picture.

use glam::{DVec3, Vec2, Vec3};

use super::oracle::{self, Picture, Seen};
use crate::gi::shared::surfaces::Limits;
use crate::image::Image;
use crate::render::SurfacePixel;
use crate::scene::Camera;

/// The pixels that each is held against: to the right, below, and below that (px).
const NEIGHBOURS: [[i64; 2]; 3] = [[1, 0], [0, 1], [1, 1]];

/// Red is 1 where the pixel to the right, below, or below that is off a pixel's plane by more than
/// the limit or sees no surface, green where it has another shading normal (Hong 2015, section 4.2
/// and figure 63). What lies outside of the picture does not count, and what sees no surface is
/// black. `surfaces` are the pixels of a picture of this size (px), row by row, as the camera sees
/// them.
pub fn discontinuity(
    surfaces: &[Option<SurfacePixel>],
    size: [u32; 2],
    camera: &Camera,
    limits: Limits,
) -> Image {
    let [width, height] = size;
    let limits = oracle::Limits {
        plane_tolerance: limits.plane_tolerance.into(),
        normal_cosine: limits.normal_cosine.into(),
    };
    let pixels: Vec<Option<Seen>> = (surfaces.iter().zip(0..))
        .map(|(surface, index)| surface.map(|surface| seen(&surface, index, size, camera)))
        .collect();
    let picture = Picture {
        size,
        pixels: &pixels,
    };
    Image::from_fn(width, height, |index| {
        let [x, y] = [index as u32 % width, index as u32 / width].map(i64::from);
        let Some(here) = picture.at(x, y) else {
            return Vec3::ZERO;
        };
        let mut edge = Vec3::ZERO;
        for [right, down] in NEIGHBOURS {
            if x + right >= i64::from(width) || y + down >= i64::from(height) {
                continue;
            }
            let margins = picture
                .at(x + right, y + down)
                .map_or([-1.0, 0.0], |other| {
                    limits.margins(here, other.position - here.position, other)
                });
            let [of_position, of_normal] = margins.map(|margin| f32::from(u8::from(margin < 0.0)));
            edge = edge.max(Vec3::new(of_position, of_normal, 0.0));
        }
        edge
    })
}

/// What the pixel at a row-major index sees.
fn seen(surface: &SurfacePixel, index: u32, size: [u32; 2], camera: &Camera) -> Seen {
    let centre = Vec2::new((index % size[0]) as f32, (index / size[0]) as f32) + 0.5;
    let position = camera.position_at(centre, surface.depth_m, size);
    let tan = (0.5 * camera.vfov_deg.to_radians()).tan();
    let unit = |normal: Vec3| -> DVec3 { normal.into() };
    Seen {
        position: position.into(),
        geometric_normal: unit(surface.geometric_normal),
        shading_normal: unit(surface.shading_normal),
        footprint: (position.distance(camera.eye) * 2.0 * tan / size[1] as f32).into(),
        material: 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [u32; 2] = [24, 16];

    const LIMITS: Limits = Limits {
        plane_tolerance: 1.0,
        normal_cosine: 0.9,
    };

    /// A plane through a point (m) with a normal.
    type Plane = (Vec3, Vec3);

    fn camera() -> Camera {
        Camera {
            eye: Vec3::ZERO,
            target: Vec3::NEG_Z,
            vfov_deg: 30.0,
            ..Camera::default()
        }
    }

    /// Height of a pixel at 10 m.
    fn footprint_m() -> f32 {
        10.0 * 2.0 * 15f32.to_radians().tan() / SIZE[1] as f32
    }

    /// A plane at columns before 12, another from there on.
    fn picture(left: Plane, right: Option<Plane>) -> Vec<Option<SurfacePixel>> {
        let camera = camera();
        let [.., forward] = camera.basis();
        let pixel = |index: u32| {
            let (x, y) = (index % SIZE[0], index / SIZE[0]);
            let (point, normal) = if x < 12 { left } else { right? };
            let ray = camera.ray_direction(x as f32 + 0.5, y as f32 + 0.5, SIZE[0], SIZE[1]);
            Some(SurfacePixel {
                depth_m: normal.dot(point) / normal.dot(ray) * ray.dot(forward),
                geometric_normal: normal,
                shading_normal: normal,
                roughness: 0.0,
            })
        };
        (0..SIZE[0] * SIZE[1]).map(pixel).collect()
    }

    /// Pixels with a mark: red, green, and those of column 11 with either.
    fn counted(left: Plane, right: Option<Plane>) -> [usize; 3] {
        let marks = discontinuity(&picture(left, right), SIZE, &camera(), LIMITS).pixels;
        let count = |is: &dyn Fn(usize) -> bool| (0..marks.len()).filter(|at| is(*at)).count();
        [
            count(&|at| marks[at].x == 1.0),
            count(&|at| marks[at].y == 1.0),
            count(&|at| marks[at] != Vec3::ZERO && at as u32 % SIZE[0] == 11),
        ]
    }

    #[test]
    fn steps_and_creases_are_marked() {
        let rows = SIZE[1] as usize;
        let at = |depth_m: f32| (Vec3::new(0.0, 0.0, -depth_m), Vec3::Z);
        let step = |footprints: f32| Some(at(10.0 + footprints * footprint_m()));
        assert_eq!(counted(at(10.0), step(0.5)), [0, 0, 0]);
        assert_eq!(counted(at(10.0), step(2.0)), [rows, 0, rows]);
        assert_eq!(counted(at(10.0), None), [rows, 0, rows]);
        // Both planes go through the line x = 0 between columns 11 and 12, so positions fit.
        let turned = |degrees: f32| {
            let (sine, cosine) = degrees.to_radians().sin_cos();
            Some((at(10.0).0, Vec3::new(sine, 0.0, cosine)))
        };
        assert_eq!(counted(at(10.0), turned(20.0)), [0, 0, 0]);
        assert_eq!(counted(at(10.0), turned(30.0)), [0, rows, rows]);
    }

    /// One plane, however steep it is seen.
    #[test]
    fn ramps_are_not_marked() {
        let (sine, cosine) = 85f32.to_radians().sin_cos();
        for normal in [
            Vec3::new(0.0, sine, cosine),
            Vec3::new(-sine, 0.0, cosine),
            Vec3::new(0.0, 0.6 * sine, cosine).normalize(),
        ] {
            let plane = (Vec3::new(0.0, 0.0, -10.0), normal);
            assert_eq!(counted(plane, Some(plane)), [0, 0, 0], "{normal}");
        }
    }

    /// By hand: a pixel in front of others is marked, and so are those that have it to the right,
    /// below, or both.
    #[test]
    fn three_neighbours_count() {
        let plane = (Vec3::new(0.0, 0.0, -10.0), Vec3::Z);
        let mut pixels = picture(plane, Some(plane));
        let at = |x: u32, y: u32| (y * SIZE[0] + x) as usize;
        if let Some(pixel) = &mut pixels[at(5, 7)] {
            pixel.depth_m = 5.0;
        }
        let marks = discontinuity(&pixels, SIZE, &camera(), LIMITS).pixels;
        let found: Vec<usize> = (0..marks.len()).filter(|at| marks[*at].x > 0.0).collect();
        assert_eq!(found, [at(4, 6), at(5, 6), at(4, 7), at(5, 7)]);
    }
}
