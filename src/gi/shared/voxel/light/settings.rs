//! How voxels are lit: what a technique chooses, and what it asks of maps and memory.

use super::voxels_along;
use crate::gi::Settings;
use crate::gi::shared::voxel::LightBounces;

/// Where the direct light of voxels comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Injection {
    /// Flux of reflective shadow maps.
    Rsm,
    /// Each voxel's own albedo and normal, and the shadow maps.
    Voxel,
}

/// How the radiance of a voxel depends on the direction that it is seen from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sides {
    /// Not at all: the mean over its surface.
    One = 1,
    /// One radiance for each side of its surface, front first.
    Two = 2,
    /// One for each face of the voxel (+x, −x, +y, −y, +z, −z): of the surface that looks its way.
    Six = 6,
}

impl Sides {
    /// Bytes of so many voxels' radiances.
    pub fn radiance_bytes(self, voxel_count: u32) -> u64 {
        8 * self as u64 * u64::from(voxel_count)
    }
}

/// How light falls on a voxel that is shaded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Attenuation {
    /// By the cosine to its mean normal, or to the axis that parts its sides.
    Standard,
    /// By the cosines to the faces on the side of its mean normal, weighted with the squares of the
    /// normal's components.
    NormalWeighted,
}

/// What hides a light from a voxel that is shaded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Occlusion {
    /// The shadow map, at its mean position.
    ShadowMap = 0,
    /// The shadow map, half a voxel off along its normal.
    ShadowMapMoved = 1,
    /// The first voxel that a ray hits.
    RaysHard = 2,
    /// All voxels that a ray hits, the nearer the more.
    RaysSoft = 3,
    /// As `ShadowMap`; of voxels with several planes by the area that the shadow map sees in them.
    ShadowMapArea = 4,
    /// The scene's triangles, from points of its surface.
    Triangles = 5,
}

/// Who sees the voxels next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Viewer {
    /// Other voxels.
    Voxels,
    /// The diffuse gather of the picture.
    Picture,
    /// A specular cone of the picture.
    Mirror,
}

/// Who sees in the voxels what surfaces emit; to the others it comes in another way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EmissionSeenBy {
    /// Every viewer.
    All,
    /// Every viewer but the diffuse gather of the picture.
    VoxelsAndMirror,
    /// Specular cones alone.
    Mirror,
}

impl EmissionSeenBy {
    /// Whether this viewer sees it.
    pub fn includes(self, viewer: Viewer) -> bool {
        match self {
            EmissionSeenBy::All => true,
            EmissionSeenBy::VoxelsAndMirror => viewer != Viewer::Picture,
            EmissionSeenBy::Mirror => viewer == Viewer::Mirror,
        }
    }
}

/// How voxels are lit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightSettings {
    /// Where their direct light comes from.
    pub injection: Injection,
    /// Radiances of a voxel.
    pub sides: Sides,
    /// Directional voxels are stored face by face, and not side by side: where no dense volume
    /// holds the faces.
    pub stores_faces: bool,
    /// Indirect bounces.
    pub bounces: LightBounces,
    /// How light on shaded voxels falls off with the angle.
    pub attenuation: Attenuation,
    /// What hides lights from shaded voxels.
    pub occlusion: Occlusion,
    /// κ of soft occlusion (voxels).
    pub kappa: f32,
    /// Who sees what surfaces emit.
    pub emission: EmissionSeenBy,
    /// Texels of reflective shadow maps along an edge of a voxel, were a map as wide as the scene;
    /// 0: as many as shadow maps have.
    pub rsm_per_voxel: u32,
}

impl LightSettings {
    /// From a technique's settings.
    pub fn new(settings: &Settings, sides: Sides) -> Self {
        let injection = if settings.is("injection", "rsm") {
            Injection::Rsm
        } else {
            Injection::Voxel
        };
        let attenuation = if settings.is("attenuation", "standard") {
            Attenuation::Standard
        } else {
            Attenuation::NormalWeighted
        };
        let occlusion = match settings.choice("voxel_occlusion") {
            "shadow-map" => Occlusion::ShadowMap,
            "shadow-map-area" => Occlusion::ShadowMapArea,
            "shadow-map-moved" => Occlusion::ShadowMapMoved,
            "rays-hard" => Occlusion::RaysHard,
            "triangles" => Occlusion::Triangles,
            _ => Occlusion::RaysSoft,
        };
        LightSettings {
            injection,
            sides,
            stores_faces: false,
            bounces: LightBounces::new(settings),
            attenuation,
            occlusion,
            kappa: settings.number("occlusion_kappa"),
            emission: EmissionSeenBy::All,
            rsm_per_voxel: settings.count("rsm_per_voxel"),
        }
    }

    /// Settings with this injection and these sides; everything else is the default.
    pub fn direct(injection: Injection, sides: Sides) -> Self {
        let (attenuation, occlusion) = (Attenuation::Standard, Occlusion::ShadowMap);
        LightSettings {
            injection,
            sides,
            stores_faces: false,
            bounces: LightBounces::Count(1),
            attenuation,
            occlusion,
            kappa: 1.0,
            emission: EmissionSeenBy::All,
            rsm_per_voxel: 0,
        }
    }

    /// Width and height (texels) of reflective shadow maps for voxels of a size (m) in a scene of
    /// an extent (m), where they need not be as fine as shadow maps.
    pub fn rsm_size(&self, extent_m: f32, voxel_size: Option<f32>) -> Option<u32> {
        let along = voxels_along(extent_m, voxel_size?);
        (self.rsm_per_voxel > 0).then(|| self.rsm_per_voxel.saturating_mul(along))
    }

    /// Radiances of a voxel, with an opacity each: of its sides, or of its faces.
    pub fn radiances(&self) -> u32 {
        if self.stores_faces {
            6
        } else {
            self.sides as u32
        }
    }

    /// Bytes of so many voxels' radiances.
    pub fn radiance_bytes(&self, voxel_count: u32) -> u64 {
        8 * u64::from(self.radiances()) * u64::from(voxel_count)
    }

    /// Whether maps of the lights say where light reaches voxels.
    pub fn reads_maps(&self) -> bool {
        self.injection == Injection::Rsm || !self.traces() && !self.meets_triangles()
    }

    /// Whether rays from voxels to lights meet the scene's triangles.
    pub fn meets_triangles(&self) -> bool {
        self.occlusion == Occlusion::Triangles
    }

    /// Whether voxels see lights by rays through voxels, for which the grid has to be whole.
    pub fn traces(&self) -> bool {
        matches!(self.occlusion, Occlusion::RaysHard | Occlusion::RaysSoft)
    }
}
