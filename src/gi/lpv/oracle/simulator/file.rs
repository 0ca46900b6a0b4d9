//! Injectors from a file.

use std::ops::Range;

use glam::{DVec3, UVec3};
use serde::Deserialize;
use toml::Spanned;

use super::{Emission, Injected, Setup};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FileToml {
    cell: Vec<Spanned<CellToml>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CellToml {
    at: [u32; 3],
    /// Of the lobe (W).
    flux: Option<f64>,
    /// Main direction of the lobe.
    normal: Option<[f64; 3]>,
    /// Two bands of intensity (W/sr), in the order of [`crate::gi::shared::sh`].
    coefficients: Option<[f64; 4]>,
}

/// An injector file that cannot be used, and the line that is wrong.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
#[error("{origin}:{line}: {problem}")]
pub struct InjectorError {
    origin: String,
    line: usize,
    problem: String,
}

/// Adds the light of a file's cells, times a multiplier. `origin` names the file in errors.
pub fn inject_file(
    setup: &mut Setup,
    (origin, text): (&str, &str),
    multiplier: f64,
) -> Result<(), InjectorError> {
    let wrong = |span: Range<usize>, problem: String| InjectorError {
        origin: origin.to_owned(),
        line: 1 + text.get(..span.start).unwrap_or("").matches('\n').count(),
        problem,
    };
    let file: FileToml = toml::from_str(text)
        .map_err(|error| wrong(error.span().unwrap_or(0..0), error.message().to_owned()))?;
    for entry in &file.cell {
        let (cell, span) = (entry.get_ref(), entry.span());
        let emission = emission(cell, multiplier).map_err(|what| wrong(span.clone(), what))?;
        let at = UVec3::from(cell.at);
        let size = setup.grid.size;
        if at.cmpge(size).any() {
            let problem = format!("at: cell {at} is outside of a grid of {size} cells, from 0");
            return Err(wrong(span, problem));
        }
        setup.injected.push(Injected { cell: at, emission });
    }
    Ok(())
}

fn emission(cell: &CellToml, multiplier: f64) -> Result<Emission, String> {
    match (cell.flux, cell.normal, cell.coefficients) {
        (Some(flux), Some(normal), None) => {
            if !(flux >= 0.0 && flux.is_finite()) {
                return Err(format!("flux: {flux} W has to be 0 or more"));
            }
            let normal = DVec3::from(normal)
                .try_normalize()
                .ok_or("normal: it has to have a length")?;
            Ok(Emission::Cosine(multiplier * flux * normal))
        }
        (None, None, Some(all)) => {
            if !all.iter().all(|c| c.is_finite()) {
                return Err("coefficients: they have to be finite".to_owned());
            }
            Ok(Emission::Coefficients(all.map(|c| multiplier * c)))
        }
        _ => Err("a cell has either flux and normal, or coefficients".to_owned()),
    }
}
