//! What a side of the window can show: one row for each view, and the views that techniques have of
//! themselves.

use std::sync::LazyLock;

use super::picture::terms_of;
use crate::frame::Renderer;
use crate::gi::inspect::{Scale, ViewRow};
use crate::gi::registry;
use crate::graph::Error;
use crate::image::{Aov, Image};
use crate::render::{MapChannel, SurfaceChannel, Terms};

/// Where a view's picture is from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Source {
    /// An output of `lumivox render`.
    Aov(Aov),
    /// A channel of the G-buffer.
    Surface(SurfaceChannel),
    /// A channel of the light maps, one map at a time.
    LightMap(MapChannel),
    /// A level of a view that techniques have of themselves.
    Own(&'static ViewRow),
}

/// What a view shows one of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Layers {
    /// The light maps, in their order.
    Maps,
    /// Levels of a store, 0 the finest.
    Levels,
}

/// One row of the table of views.
#[derive(Clone, Debug)]
pub(super) struct View {
    /// Name in the list and in scripts.
    pub(super) name: &'static str,
    /// What it shows, in one line.
    pub(super) help: &'static str,
    /// Unit of its numbers; empty for none.
    pub(super) unit: &'static str,
    /// Where it is from.
    pub(super) source: Source,
    /// How it is shown.
    pub(super) scale: Scale,
}

/// All views, each name once; the first is what a window opens with.
pub(super) static VIEWS: LazyLock<Vec<View>> = LazyLock::new(|| {
    let mut views = SHARED.to_vec();
    for own in registry::all()
        .iter()
        .flat_map(|entry| entry.views.iter().copied().flatten())
    {
        if views.iter().all(|view| view.name != own.name) {
            views.push(row(
                own.name,
                own.help,
                own.unit,
                Source::Own(own),
                own.scale,
            ));
        }
    }
    views
});

/// The views that any technique has.
static SHARED: &[View] = &[
    row(
        "full",
        "all light that reaches the camera",
        "W/(m² sr)",
        Source::Aov(Aov::Full),
        Scale::Light,
    ),
    row(
        "direct",
        "light of the lights, reflected once",
        "W/(m² sr)",
        Source::Aov(Aov::Direct),
        Scale::Light,
    ),
    row(
        "indirect",
        "what the technique adds: ρ/π · E_i + L_s",
        "W/(m² sr)",
        Source::Aov(Aov::Indirect),
        Scale::Light,
    ),
    row(
        "diffuse",
        "the technique's indirect diffuse irradiance E_i",
        "W/m²",
        Source::Aov(Aov::Diffuse),
        Scale::Light,
    ),
    row(
        "specular",
        "the technique's indirect specular radiance L_s",
        "W/(m² sr)",
        Source::Aov(Aov::Specular),
        Scale::Light,
    ),
    row(
        "visibility",
        "ambient visibility: 1 is open, 0 is enclosed",
        "",
        Source::Aov(Aov::Visibility),
        Scale::Share,
    ),
    row(
        "emission",
        "light that surfaces send out themselves",
        "W/(m² sr)",
        Source::Aov(Aov::Emission),
        Scale::Light,
    ),
    row(
        "albedo",
        "G-buffer: diffuse albedo ρ",
        "",
        Source::Aov(Aov::Albedo),
        Scale::Share,
    ),
    row(
        "normal",
        "G-buffer: shading normal in world space",
        "",
        Source::Aov(Aov::Normal),
        Scale::Signed,
    ),
    row(
        "depth",
        "G-buffer: distance along the view axis, white at the farthest surface",
        "m",
        Source::Aov(Aov::Depth),
        Scale::Range,
    ),
    row(
        "discontinuity",
        "where pixels share no light: red by position, green by normal",
        "",
        Source::Aov(Aov::Discontinuity),
        Scale::Share,
    ),
    row(
        "geometric-normal",
        "G-buffer: normal of the triangle, on the viewer's side",
        "",
        Source::Surface(SurfaceChannel::GeometricNormal),
        Scale::Signed,
    ),
    row(
        "roughness",
        "G-buffer: GGX roughness, black where there is no lobe",
        "",
        Source::Surface(SurfaceChannel::Roughness),
        Scale::Share,
    ),
    row(
        "f0",
        "G-buffer: specular reflectance at normal incidence",
        "",
        Source::Surface(SurfaceChannel::F0),
        Scale::Share,
    ),
    row(
        "shadow-map",
        "depth from a light, white is near (one of its maps)",
        "",
        Source::LightMap(MapChannel::Depth),
        Scale::Range,
    ),
    row(
        "rsm-normal",
        "reflective shadow map: normal (where the technique injects from one)",
        "",
        Source::LightMap(MapChannel::Normal),
        Scale::Signed,
    ),
    row(
        "rsm-reflected",
        "reflective shadow map: albedo × falloff (where the technique injects from one)",
        "",
        Source::LightMap(MapChannel::Reflected),
        Scale::Share,
    ),
];

const fn row(
    name: &'static str,
    help: &'static str,
    unit: &'static str,
    source: Source,
    scale: Scale,
) -> View {
    View {
        name,
        help,
        unit,
        source,
        scale,
    }
}

/// Position of the view of a name.
pub(super) fn find(name: &str) -> Option<usize> {
    VIEWS.iter().position(|view| view.name == name)
}

impl View {
    /// What it shows one of: light maps, or levels.
    pub(super) fn layers(&self) -> Option<Layers> {
        match self.source {
            Source::LightMap(_) => Some(Layers::Maps),
            Source::Own(_) => Some(Layers::Levels),
            Source::Aov(_) | Source::Surface(_) => None,
        }
    }

    /// Whether its picture has the shape of a light map instead of the window's.
    pub(super) fn is_map(&self) -> bool {
        self.layers() == Some(Layers::Maps)
    }

    /// The terms of a frame's light that it shows, of which `full` has those that are switched on;
    /// `None` where it shows something else.
    pub(super) fn terms(&self, components: Terms) -> Option<Terms> {
        match self.source {
            Source::Aov(Aov::Full) => Some(components),
            Source::Aov(aov) => terms_of(aov),
            Source::Surface(_) | Source::LightMap(_) | Source::Own(_) => None,
        }
    }

    /// Reads the last frame's picture; `None` where this technique or scene has none.
    pub(super) fn read(&self, renderer: &Renderer<'_>, layer: u32) -> Result<Option<Image>, Error> {
        match self.source {
            Source::Aov(aov) => renderer.aov(aov).map(Some),
            Source::Surface(channel) => renderer.surface(channel).map(Some),
            Source::LightMap(channel) => renderer.light_map(channel, layer),
            Source::Own(view) => renderer.view(view, layer),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_output_of_render_has_one_view_and_names_are_unique() {
        for aov in Aov::ALL {
            assert_eq!(
                VIEWS
                    .iter()
                    .filter(|view| view.source == Source::Aov(aov) && view.name == aov.name())
                    .count(),
                1,
                "{aov}"
            );
        }
        assert!((0..VIEWS.len()).all(|index| find(VIEWS[index].name) == Some(index)));
        assert_eq!(VIEWS[0].source, Source::Aov(Aov::Full));
    }
}
