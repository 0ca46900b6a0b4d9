//! Settings that suit a scene.

use crate::gi::Context;
use crate::gi::entry::{Suited, value_of};
use crate::gi::shared::voxel::Survey;
use crate::graph::{Error, Gpu};

/// Where it starts, and where it ends at the latest. Beyond, light in voxels gets little better
/// (`docs/measured/defaults.md`).
const RESOLUTIONS: [u32; 2] = [128, 256];

/// Share of mixed voxels up to which rays through voxels were right to 10% in every scene that was
/// measured (`docs/measured/defaults.md`).
const MOST_MIXED: f64 = 0.1;

/// Triangles up to which rays meet them in less time than they walk through voxels
/// (`docs/measured/defaults.md`).
const FEW_TRIANGLES: u32 = 500;

/// Rays a pixel against triangles, whose visibility is exact: with 16 it is their noise that keeps
/// Sponza from 10%.
const RAYS_AT_TRIANGLES: u32 = 32;

/// Texels of a light map for each voxel of its width, so that every lit voxel gets some: a light
/// sees the scene's diagonal, √3 of its extent.
const TEXELS_A_VOXEL: u32 = 4;

/// Light maps have no fewer texels: they shadow the direct light of pixels too.
const LEAST_TEXELS: u32 = 1024;

/// Where many voxels are mixed, or triangles are few, rays against the scene's own triangles and
/// light of each face of a voxel; voxels so fine that few are mixed, as far as half of the memory
/// that is left and the device's buffers allow; light maps that are as fine. A gather or a
/// resolution that is set stays, and what goes with it is not chosen. Voxels finer than the finest
/// choice are not made to look at them.
pub(super) fn suit(context: &Context<'_>, set: &[String]) -> Result<Option<Suited>, Error> {
    let Context { gpu, scene, .. } = *context;
    let [coarsest, finest] = RESOLUTIONS;
    let own: Option<u32> = value_of(set, "resolution").and_then(|value| value.parse().ok());
    let mut survey = Survey::new(gpu, scene, own.unwrap_or(coarsest).min(finest))?;
    let triangles: u32 = scene.batches.iter().map(|batch| batch.triangle_count).sum();
    let gather = value_of(set, "gather").unwrap_or(
        if survey.mixed > MOST_MIXED || triangles <= FEW_TRIANGLES {
            "triangles"
        } else {
            "rays"
        },
    );
    let mut pairs = match gather {
        "triangles" => vec![
            "gather=triangles".into(),
            "radiance=six-sided".into(),
            format!("rays={RAYS_AT_TRIANGLES}"),
        ],
        "rays" => vec!["gather=rays".into(), "radiance=two-sided".into()],
        _ => Vec::new(),
    };
    let room = gpu.memory_left() / 2;
    while own.is_none()
        && survey.mixed > MOST_MIXED
        && survey.resolution < finest
        && survey.bytes_of_finer() <= room
        && survey.flux_of_finer() <= gpu.limits().storage_buffer_bytes
    {
        match Survey::new(gpu, scene, 2 * survey.resolution) {
            Ok(finer) => survey = finer,
            Err(Error::TooLarge { .. } | Error::OutOfMemory { .. }) => break,
            Err(error) => return Err(error),
        }
    }
    if own.is_none() {
        pairs.push(format!("resolution={}", survey.resolution));
    }
    Ok(Some(Suited {
        pairs,
        shadow_resolution: Some((TEXELS_A_VOXEL * survey.resolution).max(LEAST_TEXELS)),
        because: format!(
            "{triangles} triangles, voxels of {} of which {:.0}% hold more than one plane",
            length(survey.voxel_size_m),
            100.0 * survey.mixed
        ),
        needs: (survey.mixed > MOST_MIXED && own.is_none_or(|own| own <= finest))
            .then(|| needs(gpu, &survey, gather, room)),
    }))
}

/// What finer voxels would need.
fn needs(gpu: &Gpu, survey: &Survey, gather: &str, room: u64) -> String {
    let mib = |bytes: u64| bytes >> 20;
    let (finer, wanted) = (2 * survey.resolution, survey.bytes_of_finer());
    let memory = if wanted > room {
        format!(
            ", which may take {} of the {} MiB left",
            mib(wanted),
            mib(2 * room)
        )
    } else {
        String::new()
    };
    // Rays light voxels without a sum for each face.
    let light = if survey.flux_of_finer() > gpu.limits().storage_buffer_bytes {
        " injection=voxel voxel_occlusion=triangles"
    } else {
        ""
    };
    let seen = match gather {
        "triangles" => "rays meet the triangles themselves, but the light on",
        _ => "what is seen and lit of",
    };
    format!(
        "{seen} parts thinner than a voxel may be off by more than 10%: it needs \
         resolution={finer}{light}{memory}"
    )
}

/// A length in the unit that it is read best in.
fn length(metres: f32) -> String {
    if metres < 0.01 {
        format!("{:.1} mm", 1000.0 * metres)
    } else if metres < 1.0 {
        format!("{:.1} cm", 100.0 * metres)
    } else {
        format!("{metres:.1} m")
    }
}
