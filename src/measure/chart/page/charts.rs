//! The charts of a scene: every point leads to its row in the table.

use maud::{Markup, PreEscaped, html};

use super::super::point::{Cost, Point};
use super::super::section::{Section, Standing, error_text};
use crate::measure::draw::ChartError;

/// Radius within which a pointer is at a point, in the units of the chart.
const REACH: u32 = 8;

pub(super) fn charts(section: &Section) -> Result<Markup, ChartError> {
    let charts = Cost::ALL
        .into_iter()
        .map(|cost| chart(section, cost))
        .collect::<Result<Vec<_>, _>>()?;
    Ok(html! { @for chart in charts { (chart) } })
}

/// The chart of a cost, as wide as the page; nothing where no point has a price.
fn chart(section: &Section, cost: Cost) -> Result<Markup, ChartError> {
    let Some(chart) = section.chart(cost) else {
        return Ok(html! {});
    };
    let (svg, places) = chart.svg_and_places()?;
    let standings = section.standings(cost);
    let mut points: Vec<(usize, (i32, i32))> =
        section.drawn(cost).into_iter().zip(places).collect();
    // What comes last lies on top: the numbered points.
    points.sort_by_key(|(index, _)| matches!(standings[*index], Some(Standing::Front(_))));
    // Inside of HTML an SVG needs no name space.
    let svg = svg.replacen(" xmlns=\"http://www.w3.org/2000/svg\"", "", 1);
    let drawing = svg.trim_end().trim_end_matches("</svg>");
    Ok(html! {
        div.chart {
            (PreEscaped(drawing))
            @for (index, (x, y)) in points {
                @let point = &section.points[index];
                a.point href={ "#" (point.key) } {
                    title { (in_words(point, cost)) }
                    circle cx=(x) cy=(y) r=(REACH) {}
                }
            }
            (PreEscaped("</svg>"))
        }
    })
}

/// Name, settings, cost and error.
fn in_words(point: &Point, cost: Cost) -> String {
    let name = [point.name(), point.changes_text()].join(" ");
    let spread = point.cost(cost).map(|spread| cost.text(spread));
    let error = point
        .error
        .map(|error| format!("error {}", error_text(error.rel_rmse)));
    let figures: Vec<String> = spread.into_iter().chain(error).collect();
    format!("{}: {}", name.trim_end(), figures.join(", "))
}

#[cfg(test)]
mod tests {
    use super::super::super::section::tests::section;
    use super::*;

    /// Every point of every chart leads to its own row, from its own place: rising times lie
    /// further right, and a numbered point lies on top.
    #[test]
    fn points_lead_to_their_rows() -> Result<(), ChartError> {
        let section = section();
        let html = chart(&section, Cost::Frame)?.into_string();
        let place = |index: usize| {
            let start = format!(
                "<a class=\"point\" href=\"#{}\">",
                section.points[index].key
            );
            let (before, after) = html.split_once(&start)?;
            let number = after.split_once("cx=\"")?.1.split('"').next()?;
            Some((number.parse::<i32>().ok()?, before.len()))
        };
        let places: Vec<_> = (0..4).filter_map(place).collect();
        assert_eq!(places.len(), 4, "{html}");
        assert!(places[0].0 < places[1].0 && places[1].0 < places[2].0);
        assert!([0, 2, 3].iter().all(|front| places[1].1 < places[*front].1));
        assert!(html.contains("<title>a cones 64³ cones=9: 10 ms (9 to 12), error 15.0%</title>"));
        assert!(!html.contains("http"));
        Ok(())
    }
}
