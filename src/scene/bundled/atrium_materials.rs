//! The materials of the atrium.

use glam::{Vec2, Vec3};

use super::super::{Material, Specular};
use super::mesh::Mesh;
use super::picture::{
    brick, fractal, large, large_normals, mask, noise, smoothstep, tile, tile_tint,
};

/// Indices of the materials.
pub(super) struct Materials {
    pub(super) brick: u32,
    pub(super) plaster: u32,
    pub(super) stone: u32,
    pub(super) marble: u32,
    pub(super) cornice: u32,
    pub(super) court_tiles: u32,
    pub(super) gallery_tiles: u32,
    pub(super) terracotta: u32,
    pub(super) soil: u32,
    pub(super) leaves: u32,
    pub(super) wood: u32,
    pub(super) water: u32,
    /// Red, blue, yellow and green.
    pub(super) cloths: [u32; 4],
}

impl Materials {
    pub(super) fn new(mesh: &mut Mesh) -> Self {
        Materials {
            brick: brick_wall(mesh),
            plaster: mesh.matte("plaster", [0.78, 0.72, 0.62]),
            stone: stone(mesh, "stone", [0.62, 0.53, 0.41], 21),
            marble: stone(mesh, "marble", [0.76, 0.71, 0.63], 37),
            cornice: mesh.matte("cornice", [0.68, 0.6, 0.49]),
            court_tiles: court_tiles(mesh),
            gallery_tiles: gallery_tiles(mesh),
            terracotta: mesh.matte("terracotta", [0.52, 0.22, 0.12]),
            soil: mesh.matte("soil", [0.07, 0.05, 0.035]),
            leaves: leaves(mesh),
            wood: wood(mesh),
            water: water(mesh),
            cloths: [
                cloth(mesh, "cloth_red", [0.62, 0.04, 0.03], [0.75, 0.5, 0.16]),
                cloth(mesh, "cloth_blue", [0.04, 0.12, 0.5], [0.7, 0.66, 0.55]),
                cloth(mesh, "cloth_yellow", [0.75, 0.45, 0.05], [0.45, 0.08, 0.04]),
                cloth(mesh, "cloth_green", [0.05, 0.35, 0.1], [0.7, 0.6, 0.25]),
            ],
        }
    }
}

fn textured(name: &str, albedo_texture: u32) -> Material {
    Material {
        name: name.to_owned(),
        albedo: Vec3::ONE,
        albedo_texture: Some(albedo_texture),
        ..Material::default()
    }
}

fn brick_wall(mesh: &mut Mesh) -> u32 {
    let albedo = mesh.texture(large("brick", |uv| {
        let (tint, face) = brick(uv);
        let clay = Vec3::new(0.42, 0.19, 0.11).lerp(Vec3::new(0.58, 0.33, 0.2), tint);
        Vec3::new(0.55, 0.51, 0.45).lerp(clay, face) * (0.75 + 0.5 * fractal(uv, 16, 5))
    }));
    let normal = mesh.texture(large_normals("brick_normal", |uv| {
        0.006 * brick(uv).1 + 0.004 * fractal(uv, 32, 9)
    }));
    mesh.tiled_material(
        Material {
            normal_texture: Some(normal),
            ..textured("brick", albedo)
        },
        1.2,
    )
}

fn stone(mesh: &mut Mesh, name: &str, color: [f32; 3], seed: u32) -> u32 {
    let albedo = mesh.texture(large(name, |uv| {
        let warp = Vec2::new(fractal(uv, 4, seed + 60), fractal(uv, 4, seed + 70));
        let veins = 1.0 - (2.0 * fractal(uv + 0.15 * warp, 4, seed) - 1.0).abs();
        Vec3::from(color)
            * (0.82 + 0.3 * fractal(uv, 8, seed + 30))
            * (1.0 - 0.25 * smoothstep(0.85, 1.0, veins))
    }));
    mesh.tiled_material(textured(name, albedo), 1.5)
}

fn court_tiles(mesh: &mut Mesh) -> u32 {
    let color = |uv: Vec2| {
        let (cell, face) = tile(uv, 4.0, 0.03);
        let is_dark = (cell.x + cell.y).rem_euclid(2.0) == 0.0;
        let base = if is_dark {
            Vec3::new(0.3, 0.27, 0.24)
        } else {
            Vec3::new(0.66, 0.58, 0.46)
        };
        let worn = base * (0.85 + 0.2 * tile_tint(cell, 8) + 0.2 * (fractal(uv, 8, 13) - 0.5));
        Vec3::new(0.2, 0.18, 0.16).lerp(worn, face)
    };
    let albedo = mesh.texture(large("court_tiles", color));
    let normal = mesh.texture(large_normals("court_tiles_normal", |uv| {
        0.004 * tile(uv, 4.0, 0.03).1
    }));
    mesh.tiled_material(
        Material {
            normal_texture: Some(normal),
            ..textured("court_tiles", albedo)
        },
        2.0,
    )
}

fn gallery_tiles(mesh: &mut Mesh) -> u32 {
    let albedo = mesh.texture(large("gallery_tiles", |uv| {
        let (cell, face) = tile(uv, 6.0, 0.04);
        let clay = Vec3::new(0.5, 0.24, 0.14) * (0.75 + 0.45 * tile_tint(cell, 17));
        Vec3::new(0.35, 0.31, 0.27).lerp(clay * (0.9 + 0.2 * fractal(uv, 16, 23)), face)
    }));
    mesh.tiled_material(textured("gallery_tiles", albedo), 1.8)
}

/// Five pointed leaves on a sprig, as a mask over a green picture.
pub(super) fn leaves(mesh: &mut Mesh) -> u32 {
    let albedo = mesh.texture(large("leaves", |uv| {
        Vec3::new(0.06, 0.2, 0.03).lerp(Vec3::new(0.2, 0.42, 0.08), fractal(uv, 8, 41))
            * (0.8 + 0.4 * noise(uv, 4, 43))
    }));
    let coverage = mesh.texture(mask("leaves_mask", 512, |uv| {
        let stem = (uv.x - 0.5).abs() < 0.015 && uv.y < 0.9;
        let leaf = |root_y: f32, turn: f32, length: f32| {
            let (sin, cos) = turn.sin_cos();
            let p = uv - Vec2::new(0.5, root_y);
            let (along, across) = (
                (p.x * sin + p.y * cos) / length,
                (p.x * cos - p.y * sin) / length,
            );
            (0.0..1.0).contains(&along)
                && across.abs() < 0.2 * (std::f32::consts::PI * along.powf(0.8)).sin()
        };
        let pairs = [(0.08, 1.1, 0.42), (0.28, 0.95, 0.44), (0.48, 0.75, 0.42)];
        stem || leaf(0.62, 0.0, 0.36)
            || pairs.iter().any(|(root_y, turn, length)| {
                leaf(*root_y, *turn, *length) || leaf(root_y + 0.07, -turn, *length)
            })
    }));
    mesh.material(Material {
        mask_texture: Some(coverage),
        ..textured("leaves", albedo)
    })
}

/// Rings of wood, light and dark.
pub(super) fn wood(mesh: &mut Mesh) -> u32 {
    let albedo = mesh.texture(large("wood", |uv| {
        let rings = (uv.y * 14.0 + 2.0 * fractal(Vec2::new(uv.x, uv.y), 4, 51)).fract();
        Vec3::new(0.2, 0.1, 0.045).lerp(Vec3::new(0.36, 0.2, 0.1), (2.0 * rings - 1.0).abs())
    }));
    mesh.tiled_material(textured("wood", albedo), 0.5)
}

fn water(mesh: &mut Mesh) -> u32 {
    let specular = Some(Specular {
        f0: Vec3::splat(0.02),
        roughness: 0.08,
        metalness: 0.0,
        texture: None,
    });
    mesh.material(Material {
        name: String::from("water"),
        albedo: Vec3::new(0.02, 0.07, 0.08),
        specular,
        ..Material::default()
    })
}

/// A dyed weave with bands near its ends.
fn cloth(mesh: &mut Mesh, name: &str, dye: [f32; 3], band: [f32; 3]) -> u32 {
    let albedo = mesh.texture(large(name, |uv| {
        let end = (uv.y - 0.5).abs();
        let is_band = (0.40..0.43).contains(&end) || (0.445..0.455).contains(&end);
        let diamonds = ((uv.x * 6.0).fract() - 0.5).abs() + ((end - 0.35) * 24.0).abs() < 0.42;
        let weave = 0.85
            + 0.15
                * ((uv.x * 128.0).fract() - 0.5).signum()
                * ((uv.y * 128.0).fract() - 0.5).signum();
        Vec3::from(if is_band || diamonds { band } else { dye })
            * weave
            * (0.85 + 0.3 * fractal(uv, 4, 61))
    }));
    mesh.material(textured(name, albedo))
}
