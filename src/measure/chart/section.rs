//! Points that can be compared with each other, and what they say.

use super::front::{Price, distinct_front, front, near_front};
use super::machine::Machine;
use super::point::{Cost, Point};
use crate::graph::Spread;
use crate::measure::build::commit;
use crate::measure::draw::{Chart, FrontPoint, Panels, PointPanel, Series, short};
use crate::measure::records::Keyed as _;
use crate::measure::report::{Timing, shadow_text};
use crate::measure::table::csv_of;
use crate::reference::Bounces;
use crate::text::counted;

/// Points of one scene with one setup.
#[derive(Clone, Debug)]
pub struct Section {
    /// The points; all have the scene and the setup of the first.
    pub points: Vec<Point>,
    /// The scene as a command line names it, where that is known.
    pub source: Option<String>,
    /// How steady the machine was.
    pub machine: Machine,
}

/// The points of one number of bounces that have a price, by index, and their prices.
#[derive(Clone, Debug)]
pub struct Group {
    /// Bounces of the techniques and of their reference.
    pub bounces: Bounces,
    /// Indices into the section's points.
    pub points: Vec<usize>,
    /// Price of each of these points, in the same order.
    pub prices: Vec<Price>,
}

/// Where a point stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Standing {
    /// On the front, and different for certain from the others there: its number on the chart.
    Front(usize),
    /// On the front, but better or cheaper than a numbered one by less than the noise of the
    /// reference or the spread of the times: grey on the chart.
    Same,
    /// Beaten by less than the spread of the times.
    Near,
    /// Beaten by more than that.
    Beaten,
}

pub(super) const MIB: f64 = (1 << 20) as f64;

impl Cost {
    /// What follows the scene's name in file names.
    pub fn file_suffix(self) -> &'static str {
        match self {
            Cost::Frame => "time",
            Cost::Rebuild => "rebuild-time",
            Cost::Memory => "memory",
        }
    }

    /// What it is, in words.
    pub fn title(self) -> &'static str {
        match self {
            Cost::Frame => "Error against time",
            Cost::Rebuild => "Error against time, structure built anew",
            Cost::Memory => "Error against memory",
        }
    }

    /// What stands before the numbers on its chart, so that no two charts of a scene have the same.
    pub(super) fn letter(self) -> char {
        match self {
            Cost::Frame => 'T',
            Cost::Rebuild => 'R',
            Cost::Memory => 'M',
        }
    }

    fn axis(self) -> &'static str {
        match self {
            Cost::Frame => "time of indirect light in a frame [ms]",
            Cost::Rebuild => "time of a build and of indirect light in a frame [ms]",
            Cost::Memory => "memory of the technique's structure [MiB]",
        }
    }

    fn what(self) -> &'static str {
        match self {
            Cost::Frame => "update + gather: geometry stands still, light and camera move",
            Cost::Rebuild => "build + update + gather: geometry is new in each frame",
            Cost::Memory => {
                "what is kept in the world; images of the screen's size, light maps and scene left \
                 out"
            }
        }
    }

    /// A value in the unit of the charts.
    fn in_unit(self, value: f64) -> f64 {
        if self == Cost::Memory {
            value / MIB
        } else {
            value
        }
    }

    /// A spread in words, such as `12.5 ms (12.1 to 13)`.
    pub fn text(self, spread: Spread) -> String {
        let median = self.median_text(spread);
        if self == Cost::Memory {
            median
        } else {
            format!("{median} ({} to {})", short(spread.min), short(spread.max))
        }
    }

    /// Its median alone, with its unit.
    pub(super) fn median_text(self, spread: Spread) -> String {
        format!(
            "{} {}",
            short(self.in_unit(spread.median)),
            if self == Cost::Memory { "MiB" } else { "ms" }
        )
    }
}

fn fits(section: &[Point], point: &Point) -> bool {
    section
        .first()
        .is_some_and(|first| first.scene == point.scene && first.setup == point.setup)
}

/// A limit in per cent, such as `5%`.
pub(super) fn percent(share: f64) -> String {
    format!("{}%", short(100.0 * share))
}

/// An error in per cent, such as `4.3%`: one digit after the point wherever an error stands.
pub(super) fn error_text(share: f64) -> String {
    format!("{:.1}%", tenths(share))
}

/// The same of a bias, with its sign.
pub(super) fn bias_text(share: f64) -> String {
    let sign = if tenths(share) > 0.0 { "+" } else { "" };
    format!("{sign}{}", error_text(share))
}

/// Per cent, rounded as they are shown; no zero is negative.
fn tenths(share: f64) -> f64 {
    (1000.0 * share).round() / 10.0 + 0.0
}

impl Section {
    /// Points of one scene and one setup, of all rounds, as if the machine had been equally fast at
    /// each: the rounds of a point become one.
    pub fn new(measured: Vec<Point>, source: Option<String>) -> Self {
        let (points, machine) = Machine::settle(measured);
        Section {
            points,
            source,
            machine,
        }
    }

    /// Points of any scenes and setups, sorted into sections in the order in which they come; of
    /// points with one key and round the first is kept.
    pub fn sort(points: impl IntoIterator<Item = Point>) -> Vec<Section> {
        let mut sections: Vec<Vec<Point>> = Vec::new();
        for point in points {
            match sections.iter_mut().find(|section| fits(section, &point)) {
                Some(section) if section.iter().any(|known| known.is_same(&point)) => {}
                Some(section) => section.push(point),
                None => sections.push(vec![point]),
            }
        }
        sections
            .into_iter()
            .map(|points| Section::new(points, None))
            .collect()
    }

    /// The points with a price, by bounces: techniques that compute different light are not
    /// compared.
    pub fn groups(&self, cost: Cost) -> Vec<Group> {
        let mut groups: Vec<Group> = Vec::new();
        for (index, point) in self.points.iter().enumerate() {
            let Some(price) = point.price(cost) else {
                continue;
            };
            match groups
                .iter_mut()
                .find(|group| group.bounces == point.bounces)
            {
                Some(group) => {
                    group.points.push(index);
                    group.prices.push(price);
                }
                None => groups.push(Group {
                    bounces: point.bounces,
                    points: vec![index],
                    prices: vec![price],
                }),
            }
        }
        groups.sort_by_key(|group| group.bounces);
        groups
    }

    /// Where each point stands among points of the same bounces; `None` where it has no price.
    /// Numbers go on from one number of bounces to the next.
    pub fn standings(&self, cost: Cost) -> Vec<Option<Standing>> {
        let mut standings = vec![None; self.points.len()];
        let mut count = 0;
        for group in self.groups(cost) {
            for (&index, near) in group.points.iter().zip(near_front(&group.prices)) {
                standings[index] = Some(if near {
                    Standing::Near
                } else {
                    Standing::Beaten
                });
            }
            front(&group.prices)
                .into_iter()
                .for_each(|member| standings[group.points[member]] = Some(Standing::Same));
            for member in self.distinct(cost, &group) {
                count += 1;
                standings[group.points[member]] = Some(Standing::Front(count));
            }
        }
        standings
    }

    /// The [distinct front](distinct_front) of a group. Many settings have the same bytes: of those
    /// that are as good, within the noise, the fastest is taken.
    fn distinct(&self, cost: Cost, group: &Group) -> Vec<usize> {
        let noise = self.noise(&group.points);
        let ms = |member: &usize| {
            self.points[group.points[*member]]
                .frame_ms()
                .map_or(f64::INFINITY, |spread| spread.median)
        };
        let fastest = |member: usize| {
            let (bytes, error) = (group.prices[member].cost.median, group.prices[member].error);
            let equal = |other: &usize| {
                group.prices[*other].cost.median == bytes
                    && group.prices[*other].error - error <= noise
            };
            (0..group.prices.len())
                .filter(equal)
                .min_by(|a, b| ms(a).total_cmp(&ms(b)))
                .unwrap_or(member)
        };
        let distinct = distinct_front(&group.prices, noise);
        if cost == Cost::Memory {
            distinct.into_iter().map(fastest).collect()
        } else {
            distinct
        }
    }

    /// Standard error of the reference of some points, in the measure of their error; 0 where it is
    /// not known.
    pub(super) fn noise(&self, points: &[usize]) -> f64 {
        points
            .iter()
            .find_map(|&index| self.points[index].noise)
            .unwrap_or(0.0)
    }

    /// The error against a cost, a panel a number of bounces; `None` where nothing has a price.
    pub fn chart(&self, cost: Cost) -> Option<Chart> {
        let first = self.points.first()?;
        let standings = self.standings(cost);
        let panels: Vec<PointPanel> = self
            .groups(cost)
            .iter()
            .map(|group| self.panel(cost, group, &standings))
            .collect();
        let setup = &first.setup;
        let timing = if setup.timing == Timing::Host {
            "passes timed on the host"
        } else {
            "passes timed by timestamps"
        };
        let mut notes = vec![
            cost.what().to_owned(),
            format!(
                "{}x{} px, shadow maps {}{}; {}; bars: smallest and largest",
                setup.size[0],
                setup.size[1],
                setup.shadow_resolution,
                shadow_text(&setup.shadows),
                self.medians_text(first)
            ),
            format!(
                "{}, {}, {timing}; lumivox {}{}",
                setup.device,
                setup.driver,
                setup.version,
                commit(&setup.build)
            ),
        ];
        if standings.contains(&Some(Standing::Same)) {
            notes.push(
                "grey, without a number: on the line, but better or cheaper than a numbered one \
                 by less than the noise or the spread"
                    .to_owned(),
            );
        }
        (!panels.is_empty()).then(|| Chart {
            title: format!("{}: {}", cost.title(), first.scene),
            notes,
            panels: Panels::Points(panels),
        })
    }

    /// What times are: medians of how many frames and builds.
    pub(super) fn medians_text(&self, first: &Point) -> String {
        let in_rounds = self.points.iter().any(|point| point.round.is_some());
        format!(
            "medians of {} and {}{}",
            counted(first.setup.frames as usize, "frame"),
            counted(first.setup.rebuilds as usize, "build"),
            if in_rounds { ", in rounds" } else { "" }
        )
    }

    /// The points that the step line joins: the front. A numbered point takes the place of others
    /// that need the same bytes.
    fn line(&self, cost: Cost, group: &Group) -> Vec<usize> {
        let distinct = self.distinct(cost, group);
        let bytes = |member: usize| group.prices[member].cost.median;
        let numbered = |member: usize| {
            distinct
                .iter()
                .copied()
                .find(|&other| cost == Cost::Memory && bytes(other) == bytes(member))
                .unwrap_or(member)
        };
        front(&group.prices).into_iter().map(numbered).collect()
    }

    /// The members of a group by technique, as the series of its panel.
    fn by_technique(&self, group: &Group) -> Vec<(&str, Vec<usize>)> {
        let mut series: Vec<(&str, Vec<usize>)> = Vec::new();
        for (member, &index) in group.points.iter().enumerate() {
            let name = self.points[index].technique.as_str();
            match series.iter_mut().find(|series| series.0 == name) {
                Some((_, members)) => members.push(member),
                None => series.push((name, vec![member])),
            }
        }
        series
    }

    /// The points of a chart by index, in the order in which it draws them.
    pub(super) fn drawn(&self, cost: Cost) -> Vec<usize> {
        let points_of = |group: &Group| -> Vec<usize> {
            let series = self.by_technique(group);
            let members = series.into_iter().flat_map(|(_, members)| members);
            members.map(|member| group.points[member]).collect()
        };
        self.groups(cost).iter().flat_map(points_of).collect()
    }

    fn panel(&self, cost: Cost, group: &Group, standings: &[Option<Standing>]) -> PointPanel {
        let at = |price: &Price| (cost.in_unit(price.cost.median), 100.0 * price.error);
        let series: Vec<Series> = self
            .by_technique(group)
            .into_iter()
            .map(|(name, members)| Series {
                name: name.to_owned(),
                points: members
                    .into_iter()
                    .map(|member| at(&group.prices[member]))
                    .collect(),
            })
            .collect();
        let front_point = |member: usize| {
            let price = &group.prices[member];
            let x_range = (cost.in_unit(price.cost.min), cost.in_unit(price.cost.max));
            let index = group.points[member];
            let mark = matches!(standings[index], Some(Standing::Front(_)))
                .then(|| standing_text(cost, standings[index]));
            FrontPoint {
                at: at(price),
                x_range,
                mark,
                label: label(&self.points[index], cost, price),
            }
        };
        let noise = Some(self.noise(&group.points)).filter(|noise| *noise > 0.0);
        let setup = &self.points[group.points[0]].setup;
        PointPanel {
            title: format!(
                "{}: {}, the numbered ones are the Pareto front",
                setup.judged_by(group.bounces),
                counted(group.points.len(), "point")
            ),
            x_label: cost.axis().to_owned(),
            y_label: format!("rel_rmse of {} [%]", setup.compared()),
            series,
            front: self
                .line(cost, group)
                .into_iter()
                .map(front_point)
                .collect(),
            floor: noise.map(|noise| (100.0 * noise, "the reference's own noise".to_owned())),
        }
    }

    /// All points as comma-separated values (RFC 4180).
    pub fn csv(&self) -> String {
        let standings = Cost::ALL.map(|cost| self.standings(cost));
        let row = |(index, point): (usize, &Point)| {
            let mut row = columns(point);
            let standing = |(cost, standings): (&Cost, &Vec<_>)| {
                (
                    format!("front {}", cost.file_suffix()),
                    standing_text(*cost, standings[index]),
                )
            };
            row.extend(Cost::ALL.iter().zip(&standings).map(standing));
            row
        };
        csv_of(&self.points.iter().enumerate().map(row).collect::<Vec<_>>())
    }
}

/// The number on the chart, `same`, `near`, or nothing.
pub(super) fn standing_text(cost: Cost, standing: Option<Standing>) -> String {
    match standing {
        Some(Standing::Front(number)) => format!("{}{number}", cost.letter()),
        Some(Standing::Same) => "same".to_owned(),
        Some(Standing::Near) => "near".to_owned(),
        Some(Standing::Beaten) | None => String::new(),
    }
}

/// Characters on a line of the key.
const KEY_CHARS: usize = 46;

/// Name, settings that differ from the preset, cost and error.
fn label(point: &Point, cost: Cost, price: &Price) -> Vec<String> {
    let mut lines = vec![point.name()];
    let mut line = String::new();
    let changes = point
        .changes
        .iter()
        .map(|(name, value)| format!("{name}={value}"));
    for word in changes.chain([format!(
        "{}, error {}",
        cost.text(price.cost),
        error_text(price.error)
    )]) {
        if !line.is_empty() && line.chars().count() + 2 + word.chars().count() > KEY_CHARS {
            lines.push(std::mem::take(&mut line));
        }
        line += if line.is_empty() { "" } else { "  " };
        line += &word;
    }
    lines.push(line);
    lines
}

/// Names and values of a row.
fn columns(point: &Point) -> Vec<(String, String)> {
    let number = |value: Option<f64>| value.map(|value| value.to_string()).unwrap_or_default();
    let setup = &point.setup;
    let mut columns: Vec<(String, String)> = Vec::new();
    let mut add = |name: &str, value: String| columns.push((name.to_owned(), value));
    add("key", point.key.clone());
    add("scene", point.scene.clone());
    add("technique", point.technique.clone());
    add("preset", point.preset.clone().unwrap_or_default());
    add("changes", point.changes_text());
    add(
        "bounces",
        if let Bounces::Count(count) = point.bounces {
            count.to_string()
        } else {
            "full".to_owned()
        },
    );
    add("width_px", setup.size[0].to_string());
    add("height_px", setup.size[1].to_string());
    add("device", setup.device.clone());
    add("driver", setup.driver.clone());
    add("version", setup.version.clone());
    add("build", setup.build.clone());
    add("failure", point.failure.clone().unwrap_or_default());
    add(
        "refused_bytes",
        point
            .refused
            .as_ref()
            .map(|refused| refused.bytes.to_string())
            .unwrap_or_default(),
    );
    add("rel_rmse", number(point.error.map(|error| error.rel_rmse)));
    add("bias", number(point.error.map(|error| error.bias)));
    add(
        "pixel rel_rmse",
        number(point.pixel_error.map(|error| error.rel_rmse)),
    );
    add("flip", number(point.flip));
    add("reference noise", number(point.noise));
    add(
        "structure_bytes",
        point
            .structure_bytes
            .map(|bytes| bytes.to_string())
            .unwrap_or_default(),
    );
    add(
        "memory_bytes",
        if point.totals.is_empty() {
            String::new()
        } else {
            point.memory_bytes.to_string()
        },
    );
    for total in &point.totals {
        let Spread {
            median, min, max, ..
        } = total.gpu_ms;
        [("ms", median), ("min ms", min), ("max ms", max)]
            .iter()
            .for_each(|(unit, ms)| add(&format!("{} {unit}", total.name), ms.to_string()));
    }
    for (material, error) in &point.materials {
        add(&format!("{material} rel_rmse"), error.rel_rmse.to_string());
        add(&format!("{material} bias"), error.bias.to_string());
    }
    point
        .settings
        .iter()
        .for_each(|(name, value)| add(&format!("set {name}"), value.clone()));
    columns
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::point::tests::point;
    use super::*;
    use crate::graph::PassTimes;

    /// Planted: of one bounce `b` is slower and worse than `a`, `c` better and dearer, and `d`
    /// better still but of two bounces.
    pub(in crate::measure::chart) fn section() -> Section {
        let a = point("a", 1, [9.0, 1.0], 1 << 20, 0.15);
        let b = point("b", 1, [99.0, 1.0], 2 << 20, 0.16);
        let c = point("c", 1, [999.0, 1.0], 3 << 20, 0.04);
        let d = point("d", 2, [4.0, 1.0], 1 << 19, 0.01);
        Section {
            machine: Machine::STEADY,
            points: vec![a, b, c, d],
            source: None,
        }
    }

    /// One digit after the point, whatever the size; a bias that rounds to 0 has no sign.
    #[test]
    fn errors_have_one_digit_after_the_point() {
        let shares = [0.04, 0.0431, 0.153_49, 1.0, 12.3456, 0.0];
        assert_eq!(
            shares.map(error_text),
            ["4.0%", "4.3%", "15.3%", "100.0%", "1234.6%", "0.0%"]
        );
        assert_eq!(
            [0.02, -0.02, 0.0001, -0.0001].map(bias_text),
            ["+2.0%", "-2.0%", "0.0%", "0.0%"]
        );
    }

    #[test]
    fn bounces_have_fronts_of_their_own() {
        let standings = section().standings(Cost::Frame);
        assert_eq!(
            standings,
            [
                Some(Standing::Front(1)),
                Some(Standing::Beaten),
                Some(Standing::Front(2)),
                Some(Standing::Front(3))
            ]
        );
        assert_eq!(
            Cost::ALL.map(|cost| standing_text(cost, standings[3])),
            ["T3", "R3", "M3"],
            "no two charts have one mark"
        );
    }

    /// 0.15 is better than 0.151 by less than the reference's noise of 0.002: the dearer of them
    /// has no number, and the chart says so.
    #[test]
    fn what_the_noise_hides_has_no_number() {
        let mut close = section();
        close.points[1] = point("b", 1, [99.0, 1.0], 2 << 20, 0.149);
        assert_eq!(
            close.standings(Cost::Frame)[..3],
            [
                Some(Standing::Front(1)),
                Some(Standing::Same),
                Some(Standing::Front(2))
            ]
        );
        let Some(chart) = close.chart(Cost::Frame) else {
            panic!("no chart")
        };
        let Panels::Points(panels) = &chart.panels else {
            panic!("{:?}", chart.panels)
        };
        assert_eq!(
            panels[0]
                .front
                .iter()
                .map(|point| point.mark.as_deref())
                .collect::<Vec<_>>(),
            [Some("T1"), None, Some("T2")]
        );
        assert!(chart.notes.iter().any(|note| note.starts_with("grey")));
        assert!(
            section()
                .chart(Cost::Frame)
                .is_some_and(|chart| !chart.notes.iter().any(|note| note.starts_with("grey")))
        );
        assert_eq!(
            close
                .csv()
                .lines()
                .nth(2)
                .map(|line| line.ends_with(",same,same,same")),
            Some(true),
            "{}",
            close.csv()
        );
        close.points[1] = point("b", 1, [99.0, 1.0], 2 << 20, 0.147);
        assert_eq!(close.standings(Cost::Frame)[1], Some(Standing::Front(2)));
    }

    /// 90 ms more in a pass of `a` put it behind `b`, whose times overlap with its own then: 100
    /// (90 to 120) against 110 (99 to 132).
    #[test]
    fn a_slowed_pass_moves_the_front() {
        let mut slowed = section();
        slowed.points[0] = point("a", 1, [109.0, 1.0], 1 << 20, 0.161);
        assert_eq!(
            slowed.standings(Cost::Frame)[..3],
            [
                Some(Standing::Near),
                Some(Standing::Front(1)),
                Some(Standing::Front(2))
            ]
        );
        slowed.points[0] = point("a", 1, [9009.0, 1.0], 1 << 20, 0.161);
        assert_eq!(
            slowed.standings(Cost::Frame)[..3],
            [
                Some(Standing::Beaten),
                Some(Standing::Front(1)),
                Some(Standing::Front(2))
            ]
        );
        assert_eq!(
            slowed.standings(Cost::Memory)[0],
            Some(Standing::Front(1)),
            "its memory is what it was"
        );
    }

    /// `e` has the bytes of `c`, and an error that is larger by less than the noise of 0.002, in a
    /// tenth of the time.
    #[test]
    fn of_equal_memory_the_fastest_is_numbered() {
        let mut equal = section();
        equal
            .points
            .push(point("e", 1, [99.0, 1.0], 3 << 20, 0.041));
        let mark = |section: &Section, index: usize| section.standings(Cost::Memory)[index];
        assert_eq!(
            (mark(&equal, 2), mark(&equal, 4)),
            (Some(Standing::Same), Some(Standing::Front(2)))
        );
        let Some(chart) = equal.chart(Cost::Memory) else {
            panic!("no chart")
        };
        let Panels::Points(panels) = &chart.panels else {
            panic!("{:?}", chart.panels)
        };
        assert_eq!(
            panels[0]
                .front
                .iter()
                .map(|point| (point.at.1.round(), point.mark.as_deref()))
                .collect::<Vec<_>>(),
            [(15.0, Some("M1")), (4.0, Some("M2"))]
        );
        assert!(
            panels[0].front[1].label[0].starts_with('e'),
            "{:?}",
            panels[0].front[1]
        );
        equal.points[4] = point("e", 1, [99.0, 1.0], 3 << 20, 0.043);
        assert_eq!(mark(&equal, 2), Some(Standing::Front(2)));
    }

    /// Planted: the machine was slower at one point of five, and a technique does without light
    /// maps. Only what techniques do is left between their frames.
    #[test]
    fn a_busy_machine_does_not_slow_one_points_frame() {
        let shared = [(1, 4.0), (2, 4.0), (3, 40.0), (4, 4.2), (5, 3.8)].map(|(key, ms)| {
            let gather = if ms == 40.0 { 99.0 } else { 9.0 };
            let mut point = point("a", 1, [gather, 1.0], 1 << 20, 0.15);
            let pass = |name: &str, ms: f64| PassTimes {
                name: name.into(),
                gpu_ms: Spread {
                    median: ms,
                    min: 0.9 * ms,
                    max: 1.2 * ms,
                    n: 3,
                },
            };
            point.key = key.to_string();
            point.passes = vec![pass("render.gbuffer", ms), pass("cone.gather", gather)];
            point
                .passes
                .extend((ms != 4.2).then(|| pass("render.rsm", 2.0 * ms)));
            point
        });
        let section = Section::new(shared.to_vec(), None);
        let frames = section.points.iter().filter_map(Point::frame_ms).map(
            |Spread {
                 median, min, max, ..
             }| [median, min, max],
        );
        assert_eq!(
            frames.collect::<Vec<_>>(),
            [
                [22.0, 21.0, 24.0],
                [22.0, 21.0, 24.0],
                [22.0, 21.0, 24.0],
                [14.0, 13.0, 16.0],
                [22.0, 21.0, 24.0]
            ]
        );
    }

    #[test]
    fn points_of_other_setups_are_not_mixed() {
        let mut other = point("a", 1, [9.0, 1.0], 1 << 20, 0.15);
        other.setup.device = "another device".into();
        let sections = Section::sort(
            section()
                .points
                .into_iter()
                .chain([other, section().points.remove(0)]),
        );
        assert_eq!(
            sections
                .iter()
                .map(|section| section.points.len())
                .collect::<Vec<_>>(),
            [4, 1]
        );
    }

    /// Every point has its mark, the front its steps and labels, and each number of bounces its
    /// panel.
    #[test]
    fn charts_show_points_and_front() {
        let Some(chart) = section().chart(Cost::Frame) else {
            panic!("no chart")
        };
        let Panels::Points(panels) = &chart.panels else {
            panic!("{:?}", chart.panels)
        };
        assert_eq!(
            panels
                .iter()
                .map(|panel| (panel.front.len(), panel.series.len()))
                .collect::<Vec<_>>(),
            [(2, 3), (1, 1)]
        );
        assert!(panels[0].front[0].at == (10.0, 15.0) && panels[0].front[0].x_range == (9.0, 12.0));
        assert!(panels[0].floor.as_ref().is_some_and(|floor| floor.0 == 0.2));
        let with = chart.pixels().unwrap_or_default();
        let mut without = chart.clone();
        let Panels::Points(panels) = &mut without.panels else {
            panic!("{:?}", chart.panels)
        };
        panels[0].front.clear();
        assert!(with != without.pixels().unwrap_or_default());
        assert!(
            chart
                .svg()
                .is_ok_and(|svg| svg.contains("cones=999") && svg.contains("2 bounces: 1 point,"))
        );
    }

    #[test]
    fn tables_have_a_row_a_point() {
        let csv = section().csv();
        let lines: Vec<&str> = csv.lines().collect();
        assert_eq!(lines.len(), 5);
        assert!(
            lines[0].contains("indirect min ms")
                && lines[0].ends_with("front time,front rebuild-time,front memory"),
            "{}",
            lines[0]
        );
        assert!(
            lines[1].ends_with(",T1,R1,M1") && lines[2].ends_with(",,,"),
            "{csv}"
        );
    }
}
