//! What an environment map sends through the border of grids. Of a radiance that is one in all
//! directions alpha tells how much arrives, and nothing else is needed.

use glam::{DVec3, DVec4, Vec3};

use super::cells::radiance_scale;
use super::grid::CellGrid;
use crate::gi::shared::sh::{self, Quadrature};
use crate::render::{GpuEnvironment, GpuScene};

/// The environment as cells store it.
#[derive(Clone, Copy)]
pub struct Inflow<'a> {
    environment: &'a GpuEnvironment,
    /// Radiance of a stored 1 (W/(m² sr)).
    scale: f32,
}

impl<'a> Inflow<'a> {
    /// For grids whose light has the scale of this one.
    pub fn new(scene: &'a GpuScene, grid: &CellGrid) -> Self {
        Inflow {
            environment: &scene.environment,
            scale: radiance_scale(scene, grid),
        }
    }

    /// Stored radiance of the map that travels along a unit direction, the mean of a solid angle
    /// (sr); black where there is no map.
    pub fn along(&self, travel: DVec3, solid_angle: f64) -> Vec3 {
        match self.environment.sky() {
            Some(_) => {
                let radiance = self.environment.around(-travel, solid_angle);
                (radiance / f64::from(self.scale)).as_vec3()
            }
            None => Vec3::ZERO,
        }
    }

    /// What a cell outside of the grid sends as a lobe in so many bands: c = ∫ (|ωx| + |ωy| +
    /// |ωz|) L(−ω) Y(ω) dω, in alpha that of an environment of radiance 1. Of that the first is
    /// 6π Y₀, and up to band 3 all others are 0.
    pub fn lobe(&self, bands: usize) -> Vec<[f32; 4]> {
        let mut sent = vec![DVec4::ZERO; bands * bands];
        let mut basis = vec![0.0; bands * bands];
        if self.environment.sky().is_some() {
            // Looked up as wide as its directions are apart.
            let quadrature = Quadrature::exact_to(64);
            let apart = 4.0 * std::f64::consts::PI / quadrature.nodes.len() as f64;
            for &(direction, weight) in &quadrature.nodes {
                sh::evaluate(bands, direction, &mut basis);
                let share = weight * direction.abs().element_sum();
                let radiance = self.along(direction, apart).as_dvec3().extend(0.0);
                for (sent, basis) in sent.iter_mut().zip(&basis) {
                    *sent += share * *basis * radiance;
                }
            }
        }
        sent[0].w = 3.0 * std::f64::consts::PI.sqrt();
        sent.iter().map(|one| one.as_vec4().to_array()).collect()
    }
}
