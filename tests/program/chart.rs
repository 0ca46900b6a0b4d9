//! `lumivox chart`: measures once, goes on after a stop, puts shards together, and shows each
//! point's own figures and pictures.

use crate::support::program::{PROGRAM, VALIDATE, command};
use crate::support::{Missing, skipped};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use lumivox::measure::chart::{Cost, PictureFolder, Point, Section, Standing, Troubles, page};
use lumivox::measure::records::{newest, read_records};

const GRID: &str = "[[sweep]]\ntechnique = [\"voxel-mips\", \"svo\"]\npreset = [\"cones\", \
                    \"textbook\"]\nset = { resolution = [8, 16] }\n";
/// Points of [`GRID`].
const COUNT: usize = 8;

/// A folder with a grid, a cache and what `chart` writes.
struct Place(tempfile::TempDir);

impl Place {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("grid.toml"), GRID).unwrap();
        Place(folder)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn command(&self) -> Command {
        let mut command = command();
        command
            .current_dir(self.0.path())
            .env("LUMIVOX_CACHE", self.path("cache"))
            .arg("chart");
        command
    }

    /// Runs a small sweep of the Cornell box.
    fn sweep(&self, arguments: &[&str]) -> Output {
        let small = [
            "bundled:cornell",
            "--grid",
            "grid.toml",
            "--size",
            "32x32",
            "--frames",
            "2",
            "--rebuilds",
            "2",
            "--shadow-resolution",
            "64",
        ];
        self.command()
            .args(small)
            .args(["--max-error", "0.2"])
            .args(arguments)
            .output()
            .unwrap()
    }

    fn records(&self, file: &str) -> Vec<Point> {
        read_records(&self.path(file)).unwrap()
    }

    /// What the records say, rounds put together.
    fn sections(&self, file: &str) -> Vec<Section> {
        Section::sort(newest(self.records(file)))
    }

    fn points(&self, file: &str) -> Vec<Point> {
        let sections = self.sections(file).into_iter();
        sections.flat_map(|section| section.points).collect()
    }

    fn text(&self, file: &str) -> String {
        std::fs::read_to_string(self.path(file)).unwrap()
    }
}

fn succeeded(output: &Output) -> String {
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// What must not depend on when and where a point was measured.
fn figures(points: &[Point]) -> BTreeMap<String, (String, Option<u64>, String)> {
    points
        .iter()
        .map(|point| {
            (
                point.key.clone(),
                (
                    point.name(),
                    point.structure_bytes,
                    format!("{:?} {:?}", point.error, point.counts),
                ),
            )
        })
        .collect()
}

/// Mean brightness of a picture.
fn brightness(path: &Path) -> f64 {
    let picture = image::open(path).unwrap().into_luma8();
    picture
        .pixels()
        .map(|pixel| f64::from(pixel.0[0]))
        .sum::<f64>()
        / f64::from(picture.width() * picture.height())
}

/// One sweep; then all that reads it: a second run, a cut-off record, wrong records, the page.
#[test]
fn measures_once_and_shows_what_it_measured() {
    let place = Place::new();
    let first = succeeded(&place.sweep(&["-o", "out"]));
    assert!(
        first.contains(&format!(
            "{COUNT} points, {COUNT} to measure, 0 from the records"
        )),
        "{first}"
    );
    let points = place.points("out/cornell.jsonl");
    assert_eq!(points.len(), COUNT);
    let pictures = PictureFolder::of(&place.path("out"));
    for point in &points {
        assert!(
            point.failure.is_none()
                && point.error.unwrap().rel_rmse > 0.0
                && point.noise.unwrap() > 0.0,
            "{point:?}"
        );
        let sum: f64 = point.passes.iter().map(|pass| pass.gpu_ms.max).sum();
        let time = point.cost(Cost::Frame).unwrap();
        assert!(
            [2, 3].contains(&time.n)
                && time.min <= time.median
                && time.median <= time.max
                && time.max <= sum,
            "{time:?}"
        );
        assert!(
            point.cost(Cost::Rebuild).unwrap().median > time.median
                && point.cost(Cost::Memory).unwrap().median > 0.0
        );
    }
    rounds_are_interleaved(&place.records("out/cornell.jsonl"), &points);
    pictures_are_their_points(&points, &pictures);
    let section = place.sections("out/cornell.jsonl").remove(0);
    charts_and_tables_are_complete(&place, &section);
    page_is_complete(&place.text("out/chart.html"), &section, &pictures);
    second_run_is_served(&place);
    cut_off_record_is_measured_again(&place);
    wrong_records_are_told(&place);
}

/// All points have their first round before any has its second, which goes backwards; then those
/// have one more that are on a front by these two, or may be, and no others.
fn rounds_are_interleaved(records: &[Point], points: &[Point]) {
    let of_round = |round: u32| -> Vec<&str> {
        let of_round = records.iter().filter(|record| record.round == Some(round));
        of_round.map(|record| record.key.as_str()).collect()
    };
    let mut rounds: Vec<Option<u32>> = records.iter().map(|record| record.round).collect();
    assert_eq!(rounds[..2 * COUNT].len(), 2 * COUNT);
    assert!(rounds.is_sorted(), "{rounds:?}");
    rounds.dedup();
    assert_eq!(rounds, [Some(1), Some(2), Some(3)]);
    let [mut first, second, third] = [1, 2, 3].map(of_round);
    first.reverse();
    assert_eq!((first.len(), first), (COUNT, second));
    let early = records.iter().filter(|record| record.round < Some(3));
    let section = Section::new(early.cloned().collect(), None);
    let unsure: BTreeSet<&str> = Cost::ALL
        .iter()
        .flat_map(|cost| section.points.iter().zip(section.standings(*cost)))
        .filter(|(_, standing)| standing.is_some_and(|standing| standing != Standing::Beaten))
        .map(|(point, _)| point.key.as_str())
        .collect();
    assert_eq!(third.iter().copied().collect::<BTreeSet<&str>>(), unsure);
    assert_eq!(third.len(), unsure.len(), "one was measured twice");
    for record in records {
        let frames = record.total("frame").unwrap().n;
        assert_eq!(frames, 1);
    }
    for point in points {
        let frames = point.total("frame").unwrap().n;
        let is_again = third.contains(&point.key.as_str());
        assert_eq!(frames, if is_again { 3 } else { 2 }, "{}", point.name());
    }
}

/// A swapped picture or heat map would be the brightness of another point's: textbook cones lose
/// most of the light, which the others keep.
fn pictures_are_their_points(points: &[Point], pictures: &PictureFolder) {
    for point in points.iter().filter(|point| {
        point.preset.as_deref() == Some("cones") && point.resolution() == Some("16")
    }) {
        let same = |other: &&Point| {
            other.technique == point.technique
                && other.resolution() == point.resolution()
                && other.key != point.key
        };
        let textbook = points.iter().find(same).unwrap();
        assert!(
            textbook.error.unwrap().rel_rmse > point.error.unwrap().rel_rmse + 0.1,
            "the two are too much alike for this test"
        );
        assert!(
            brightness(&pictures.picture(&point.key))
                > brightness(&pictures.picture(&textbook.key)) + 3.0,
            "{} is as dark as textbook",
            point.name()
        );
        assert!(
            brightness(&pictures.error(&point.key))
                < brightness(&pictures.error(&textbook.key)) - 3.0,
            "{} is as wrong as textbook",
            point.name()
        );
    }
}

fn charts_and_tables_are_complete(place: &Place, section: &Section) {
    let points = &section.points;
    for cost in Cost::ALL {
        let svg = place.text(&format!("out/cornell-{}.svg", cost.file_suffix()));
        assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"));
        let standings = section.standings(cost);
        let front: Vec<&Point> = points
            .iter()
            .zip(&standings)
            .filter(|(_, standing)| matches!(standing, Some(Standing::Front(_))))
            .map(|pair| pair.0)
            .collect();
        assert!(
            !front.is_empty() && front.iter().all(|point| svg.contains(&point.name())),
            "a point of the front has no label"
        );
        assert!(
            svg.contains("the reference&apos;s own noise")
                || svg.contains("the reference's own noise"),
            "no floor line"
        );
        assert_eq!(
            image::open(place.path(&format!("out/cornell-{}.png", cost.file_suffix())))
                .unwrap()
                .width(),
            1000
        );
    }
    let csv = place.text("out/cornell.csv");
    assert_eq!(csv.lines().count(), 1 + COUNT);
    for point in &section.points {
        let row = csv
            .lines()
            .find(|line| line.starts_with(&point.key))
            .unwrap();
        assert!(
            row.contains(&point.error.unwrap().rel_rmse.to_string())
                && row.contains(&point.cost(Cost::Frame).unwrap().median.to_string()),
            "{row}"
        );
    }
}

/// Every point has a row with its own pictures, and nothing is fetched from elsewhere.
fn page_is_complete(html: &str, section: &Section, pictures: &PictureFolder) {
    let points = &section.points;
    use base64::Engine as _;
    let encode = |path: &Path| {
        let mut bytes = std::io::Cursor::new(Vec::new());
        image::open(path)
            .unwrap()
            .write_to(&mut bytes, image::ImageFormat::Png)
            .unwrap();
        base64::engine::general_purpose::STANDARD.encode(bytes.into_inner())
    };
    for point in points {
        let row = html
            .split("<tr")
            .find(|row| row.contains(&format!("id=\"{}\"", point.key)))
            .expect("each point has a row");
        assert!(
            row.contains(&encode(&pictures.picture(&point.key)))
                && row.contains(&encode(&pictures.error(&point.key))),
            "{}",
            point.name()
        );
        assert!(row.contains(&format!("data-value=\"{}\"", point.error.unwrap().rel_rmse)));
    }
    points_lead_to_rows(html, points);
    errors_have_one_digit(html);
    assert!(
        html.contains(&points[0].setup.device)
            && html.contains(&points[0].setup.driver)
            && html.contains("reference, 1 bounce")
            && html.contains("Of all indirect light, 1 bounce leaves out ")
            && html.contains("<code>--set bounces=…</code> adds more: 2, 3, 4, feedback")
    );
    assert!(html.contains(include_str!("../../src/measure/chart/page/page.js")));
    for outside in [
        "http:",
        "https:",
        "<script src",
        "src=\"http",
        "url(",
        "@import",
        "<link",
        "<iframe",
        "fetch(",
    ] {
        assert!(!html.contains(outside), "the page has {outside}");
    }
    for place in html
        .split("href=\"")
        .skip(1)
        .map(|rest| rest.split('"').next().unwrap())
        .filter(|place| !place.starts_with("data:image/png;base64,"))
    {
        let id = place
            .strip_prefix('#')
            .unwrap_or_else(|| panic!("the page leads to {place}"));
        assert!(
            html.contains(&format!("id=\"{id}\"")),
            "there is no {place}"
        );
    }
    picks_are_complete(html, section);
}

/// Every chart has every point, as a link to its row; a picture is embedded once and shown often.
fn points_lead_to_rows(html: &str, points: &[Point]) {
    let charts: Vec<&str> = html.split("<div class=\"chart\">").skip(1).collect();
    assert_eq!(charts.len(), Cost::ALL.len());
    for chart in charts {
        let chart = chart.split("</svg>").next().unwrap();
        assert!(chart.starts_with("<svg ") && chart.contains("viewBox"));
        assert_eq!(chart.matches("<a class=\"point\"").count(), points.len());
        for point in points {
            assert!(chart.contains(&format!("<a class=\"point\" href=\"#{}\">", point.key)));
        }
    }
    for point in points {
        let row = format!(" id=\"{}\"", point.key);
        let image = format!("<image id=\"picture-{}\"", point.key);
        assert_eq!([&row, &image].map(|id| html.matches(id).count()), [1, 1]);
    }
    let heat_bars = 1;
    let references = html.matches("<image id=\"reference-").count();
    assert_eq!(
        html.matches("data:image/png").count(),
        2 * points.len() + references + heat_bars
    );
}

/// What follows the word "error" has one digit after the point, and so has what a column of errors
/// shows.
fn errors_have_one_digit(html: &str) {
    let has_one = |text: &str| {
        let digits = text.split_once('.').map(|(_, digits)| digits);
        digits.is_some_and(|digits| digits.len() == 1)
    };
    let mut errors = 0;
    for rest in html.split("error ").skip(1) {
        let number: String = rest
            .chars()
            .take_while(|c| c.is_ascii_digit() || *c == '.')
            .collect();
        if !number.is_empty() && rest[number.len()..].starts_with('%') {
            assert!(has_one(&number), "error {number}%");
            errors += 1;
        }
    }
    let cells = html.split("<td data-value=").skip(1).filter_map(|cell| {
        let shown = cell.split_once('>')?.1.split('<').next()?;
        shown.strip_suffix('%')
    });
    for shown in cells {
        assert!(has_one(shown), "a cell shows {shown}%");
        errors += 1;
    }
    assert!(errors > 0);
}

/// The first tables have a row a pick, with its settings' own command; what was not put to the
/// stress test is said not to have been.
fn picks_are_complete(html: &str, section: &Section) {
    let points = &section.points;
    let picks = section.picks();
    assert!(picks.len() == 1 && !picks[0].picks.is_empty(), "{picks:?}");
    for pick in &picks[0].picks {
        let point = &points[pick.index];
        let row = html
            .split("id=\"pick-")
            .find(|row| row.starts_with(&point.key))
            .expect("each pick has a row");
        let preset = point.preset.as_ref().unwrap();
        let command = format!(
            "--technique {} --preset {preset} --set resolution={}",
            point.technique,
            point.resolution().unwrap()
        );
        let row = row.split("</code></td>").next().unwrap();
        assert!(
            row.contains(&format!(
                "lumivox render bundled:cornell {command} --size 32x32 --shadow-resolution 64 -o \
                 picture.png"
            )),
            "{row}"
        );
        assert!(row.contains("not measured"), "{row}");
    }
}

/// Results of `lumivox stress` are found in the folder, or where the command says, and stand beside
/// the picks; a folder without any is told.
#[test]
fn failure_modes_stand_beside_the_picks() {
    let place = Place::new();
    std::fs::write(
        place.path("grid.toml"),
        "[[sweep]]\ntechnique = [\"voxel-mips\"]\npreset = [\"cones\"]\nset = { resolution = [32] \
         }\n",
    )
    .unwrap();
    let mut stress = command();
    let small = [
        "stress",
        "--size",
        "32x24",
        "--shadow-resolution",
        "64",
        "--resolution",
        "32",
        "--quick",
        "--technique",
        "voxel-mips",
        "--preset",
        "cones",
    ];
    stress
        .current_dir(place.path("."))
        .env("LUMIVOX_CACHE", place.path("cache"))
        .args(small)
        .args(["--case", "small_emitter,empty", "-o", "out/stress"]);
    succeeded(&stress.output().unwrap());
    succeeded(&place.sweep(&["-o", "out"]));
    let html = place.text("out/chart.html");
    assert!(
        html.contains("small_emitter")
            && html.contains(
                "measured</a> in the scenes of the stress suite, of voxel-mips cones 32³ (quick)"
            )
    );
    assert!(
        !html.contains("Not measured.") && html.contains("without 42 of 44 failure modes"),
        "two failure modes of its own settings were measured"
    );
    assert!(
        html.contains(
            "lumivox stress --technique voxel-mips --preset cones --resolution 32 -o out/stress"
        ),
        "the command for the others"
    );
    succeeded(
        &place
            .command()
            .args(["--merge", "out", "--stress", "out/stress", "-o", "merged"])
            .output()
            .unwrap(),
    );
    assert!(place.text("merged/chart.html").contains("small_emitter"));
    succeeded(
        &place
            .command()
            .args(["--merge", "out", "-o", "alone"])
            .output()
            .unwrap(),
    );
    assert!(place.text("alone/chart.html").contains(
        "lumivox stress --technique voxel-mips --preset cones --resolution 32 -o alone/stress"
    ));
}

fn second_run_is_served(place: &Place) {
    let before = place.text("out/cornell.jsonl");
    let second = succeeded(&place.sweep(&["-o", "out"]));
    assert!(
        second.contains(&format!(
            "{COUNT} points, 0 to measure, {COUNT} from the records"
        )),
        "{second}"
    );
    assert_eq!(place.text("out/cornell.jsonl"), before);
    // Other maps are another setup: nothing of it has a record.
    std::fs::create_dir(place.path("other")).unwrap();
    std::fs::copy(
        place.path("out/cornell.jsonl"),
        place.path("other/cornell.jsonl"),
    )
    .unwrap();
    let mut other = place.command();
    other.args([
        "bundled:cornell",
        "--grid",
        "grid.toml",
        "--size",
        "32x32",
        "--frames",
        "2",
        "--rebuilds",
        "2",
        "--shadow-resolution",
        "32",
    ]);
    let other = other
        .args(["--max-error", "0.2", "-o", "other"])
        .output()
        .unwrap();
    assert!(succeeded(&other).contains(&format!("{COUNT} points, {COUNT} to measure")));
    // Both are in the records; the newer setup is the scene's, as it was measured, and the older
    // one stands beside it.
    succeeded(
        &place
            .command()
            .args(["--merge", "other", "-o", "other"])
            .output()
            .unwrap(),
    );
    let both = place.points("other/cornell.jsonl");
    assert_eq!(
        (
            both.len(),
            both[..COUNT] == place.points("out/cornell.jsonl")
        ),
        (2 * COUNT, true)
    );
    assert!(
        !place.text("other/cornell.csv").contains(&both[0].key)
            && place.text("other/cornell_2.csv").contains(&both[0].key)
    );
}

/// A run that was killed while it wrote: what is before it is kept, and nothing is measured twice.
fn cut_off_record_is_measured_again(place: &Place) {
    let whole = place.text("out/cornell.jsonl");
    let lines = 2 * COUNT - 2;
    let kept: String = whole
        .lines()
        .take(lines)
        .map(|line| format!("{line}\n"))
        .collect();
    let half = whole.lines().nth(lines).unwrap();
    std::fs::write(
        place.path("out/cornell.jsonl"),
        format!("{kept}{}", &half[..half.len() / 2]),
    )
    .unwrap();
    let output = place.sweep(&["-o", "out"]);
    assert!(succeeded(&output).contains(&format!(
        "{COUNT} points, 2 to measure, {} from the records",
        COUNT - 2
    )));
    assert!(
        stderr(&output).contains("cornell.jsonl: the last record was cut off"),
        "{}",
        stderr(&output)
    );
    let again = place.text("out/cornell.jsonl");
    assert!(again.starts_with(&kept) && again.lines().count() > 2 * COUNT);
    assert_eq!(figures(&place.points("out/cornell.jsonl")).len(), COUNT);
    // A run that was stopped before its last measurement has that one left.
    let mut lines: Vec<&str> = again.lines().collect();
    lines.pop();
    let stopped = lines.join("\n") + "\n";
    std::fs::write(place.path("out/cornell.jsonl"), &stopped).unwrap();
    let last = succeeded(&place.sweep(&["-o", "out"]));
    assert!(
        last.contains(&format!("{COUNT} points, 1 to measure")),
        "{last}"
    );
    let end = place.text("out/cornell.jsonl");
    assert!(end.starts_with(&stopped) && end.lines().count() == lines.len() + 1);
}

fn wrong_records_are_told(place: &Place) {
    let good = place.text("out/cornell.jsonl");
    let newer = good
        .lines()
        .next()
        .unwrap()
        .replace("\"record_version\":1", "\"record_version\":99");
    for (wrong, message) in [
        ("{}\n", "missing field"),
        ("nonsense\n", "expected"),
        (newer.as_str(), "version 99, not 1"),
    ] {
        std::fs::write(
            place.path("out/cornell.jsonl"),
            format!("{}\n{}\n", good.lines().next().unwrap(), wrong.trim_end()),
        )
        .unwrap();
        let output = place.sweep(&["-o", "out"]);
        assert!(!output.status.success());
        assert!(
            stderr(&output).contains("cornell.jsonl:2: this is no record")
                && stderr(&output).contains(message),
            "{}",
            stderr(&output)
        );
    }
}

/// Shards, put together, are the whole: the same points with the same errors, memory and counts,
/// each measured by one shard.
#[test]
fn shards_merge_to_the_whole() {
    let place = Place::new();
    succeeded(&place.sweep(&["-o", "whole"]));
    for shard in ["1/3", "2/3", "3/3"] {
        succeeded(&place.sweep(&["-o", "parts", "--shard", shard]));
    }
    let parts: Vec<Vec<Point>> = (1..=3)
        .map(|shard| place.points(&format!("parts/cornell-shard-{shard}-of-3.jsonl")))
        .collect();
    assert_eq!(parts.iter().map(Vec::len).collect::<Vec<_>>(), [3, 3, 2]);
    assert!(!place.path("parts/chart.html").exists());
    merge_is_the_whole(&place, "parts");
    // A merge of a merge, and of a folder with itself, adds nothing.
    succeeded(
        &place
            .command()
            .args(["--merge", "parts", "merged", "-o", "merged"])
            .output()
            .unwrap(),
    );
    assert_eq!(place.points("merged/cornell.jsonl").len(), COUNT);
}

fn merge_is_the_whole(place: &Place, parts: &str) {
    succeeded(
        &place
            .command()
            .args(["--merge", parts, "-o", "merged"])
            .output()
            .unwrap(),
    );
    let merged = place.points("merged/cornell.jsonl");
    let records = place.records("merged/cornell.jsonl");
    assert_eq!(
        figures(&merged),
        figures(&place.points("whole/cornell.jsonl"))
    );
    // Records are copied as they were measured.
    let entries = std::fs::read_dir(place.path(parts))
        .unwrap()
        .map(|entry| entry.unwrap().path());
    let measured: Vec<Point> = entries
        .filter(|path| {
            path.extension()
                .is_some_and(|extension| extension == "jsonl")
        })
        .flat_map(|path| read_records(&path).unwrap())
        .collect();
    assert!(records.iter().all(|record| measured.contains(record)) && records.len() > COUNT);
    let html = place.text("merged/chart.html");
    let section = place.sections("merged/cornell.jsonl").remove(0);
    page_is_complete(&html, &section, &PictureFolder::of(&place.path("merged")));
    assert!(
        place.path("merged/cornell-time.svg").is_file()
            && place.path("merged/cornell.csv").is_file()
    );
}

/// The line of docs/chart.md that spreads a sweep with GNU parallel.
#[test]
fn gnu_parallel_runs_shards() {
    let is_gnu = Command::new("parallel")
        .arg("--version")
        .output()
        .is_ok_and(|output| String::from_utf8_lossy(&output.stdout).contains("GNU parallel"));
    if !is_gnu {
        skipped(&Missing::Other(
            "GNU parallel is not installed; shards_merge_to_the_whole shows the same without it",
        ));
        return;
    }
    let place = Place::new();
    succeeded(&place.sweep(&["-o", "whole"]));
    let line = format!(
        "parallel --will-cite -j 2 {} chart bundled:cornell --grid grid.toml --size 32x32 \
         --frames 2 --rebuilds 2 --shadow-resolution 64 --max-error 0.2 --shard {{}}/4 -o parts \
         ::: 1 2 3 4",
        PROGRAM
    );
    succeeded(
        &Command::new("sh")
            .args(["-c", &line])
            .current_dir(place.path("."))
            .envs([VALIDATE])
            .env("LUMIVOX_CACHE", place.path("cache"))
            .output()
            .unwrap(),
    );
    merge_is_the_whole(&place, "parts");
}

/// What a device refuses is a row of the table that says so, not the end of the sweep; names of
/// files cannot break the page.
#[test]
fn refusals_and_odd_names_are_shown() {
    let place = Place::new();
    std::fs::write(
        place.path("grid.toml"),
        "[[sweep]]\ntechnique = [\"voxel-mips\"]\npreset = [\"cones\"]\nset = { resolution = \
         [1024, 8] }\n[[sweep]]\ntechnique = [\"none\"]\n",
    )
    .unwrap();
    let output = place.sweep(&["-o", "out", "--device", "llvmpipe"]);
    succeeded(&output);
    assert!(
        stderr(&output).contains("voxel_mips.radiance"),
        "{}",
        stderr(&output)
    );
    let mut points = place.points("out/cornell.jsonl");
    let of = |resolution: Option<&str>| {
        points
            .iter()
            .find(|point| point.resolution() == resolution)
            .unwrap()
    };
    let (refused, measured, none) = (of(Some("1024")), of(Some("8")), of(None));
    assert!(
        refused
            .failure
            .as_ref()
            .unwrap()
            .contains("voxel_mips.radiance")
            && refused.refused.is_some()
            && refused.cost(Cost::Frame).is_none()
    );
    assert!(measured.failure.is_none());
    // `none` has no light, and nothing to be relative to; it is no failure either.
    assert!(
        none.error.is_none()
            && none.failure.is_none()
            && Cost::ALL.iter().all(|cost| none.price(*cost).is_none())
    );
    let html = place.text("out/chart.html");
    assert!(
        html.contains("voxel_mips.radiance")
            && points.iter().all(|point| html.contains(&point.key))
    );
    assert!(
        succeeded(&place.sweep(&["-o", "out", "--device", "llvmpipe"]))
            .contains("3 points, 0 to measure")
    );
    points
        .iter_mut()
        .for_each(|point| point.scene = "<script>alert(1)</script>\"&".to_owned());
    let html = page(
        &Section::sort(points),
        &PictureFolder::of(&place.path("out")),
        &Troubles::default(),
    )
    .unwrap();
    assert!(html.contains("&lt;script&gt;alert(1)") && !html.contains("<script>alert"));
}

/// Light in a room that the reference leaves black is relative to nothing, and so is no light: the
/// point says so, and there is no chart.
#[test]
fn a_dark_reference_gives_no_error() {
    let place = Place::new();
    let grid = "[[sweep]]\ntechnique = [\"voxel-mips\"]\npreset = [\"textbook\", \
                \"accurate\"]\nset = { resolution = [8, 64] }\n";
    std::fs::write(place.path("grid.toml"), grid).unwrap();
    let small = [
        "bundled:two-rooms",
        "--grid",
        "grid.toml",
        "--size",
        "32x24",
        "--frames",
        "1",
        "--rebuilds",
        "1",
        "--shadow-resolution",
        "64",
        "-o",
        "out",
    ];
    succeeded(&place.command().args(small).output().unwrap());
    let points = place.points("out/two-rooms.jsonl");
    assert_eq!(points.len(), 4);
    for point in &points {
        assert!(
            point.error.is_none()
                && point
                    .failure
                    .as_ref()
                    .unwrap()
                    .contains("no indirect light"),
            "{point:?}"
        );
    }
    assert!(
        place.text("out/chart.html").contains("no indirect light")
            && !place.path("out/two-rooms-time.svg").exists()
    );
}

#[test]
fn wrong_arguments_are_told() {
    let place = Place::new();
    let cases: [(&[&str], &str); 12] = [
        (&["-o", "out"], "required"),
        (&["bundled:cornell"], "--output"),
        (&["bundled:nonsense", "-o", "out"], "no bundled scene"),
        (
            &["bundled:cornell", "-o", "out", "--max-error", "0"],
            "--max-error is 0",
        ),
        (
            &["bundled:cornell", "-o", "out", "--shard", "5/4"],
            "write i/n",
        ),
        (
            &["bundled:cornell", "-o", "out", "--shard", "0/4"],
            "write i/n",
        ),
        (
            &["bundled:cornell", "-o", "out", "--grid", "absent.toml"],
            "cannot read the grid absent.toml",
        ),
        (
            &["bundled:cornell", "-o", "out", "--grid", "wrong.toml"],
            "wrong.toml:2: there is no technique nonsense",
        ),
        (
            &["--merge", "absent", "-o", "out"],
            "cannot read the folder absent",
        ),
        (&["--merge", ".", "-o", "out"], "no records"),
        (
            &["bundled:cornell", "-o", "out", "--stress", "absent"],
            "no records (*.jsonl) of lumivox stress in absent",
        ),
        (
            &["bundled:cornell", "-o", "out", "--stress", "stress"],
            "this is no record of lumivox stress",
        ),
    ];
    std::fs::write(
        place.path("wrong.toml"),
        "[[sweep]]\ntechnique = [\"nonsense\"]\n",
    )
    .unwrap();
    std::fs::create_dir(place.path("stress")).unwrap();
    std::fs::write(place.path("stress/cornell.jsonl"), "{}\n").unwrap();
    for (arguments, message) in cases {
        let output = place.command().args(arguments).output().unwrap();
        assert_eq!(
            output.status.code(),
            Some(2),
            "{arguments:?}: {}",
            stderr(&output)
        );
        assert!(
            stderr(&output).contains(message),
            "{arguments:?}: {}",
            stderr(&output)
        );
    }
    assert!(!place.path("out").exists(), "wrong arguments left a folder");
}

/// Two processes never write one file of records.
#[test]
fn a_file_in_use_is_told() {
    let place = Place::new();
    std::fs::create_dir(place.path("out")).unwrap();
    let file = std::fs::File::create(place.path("out/cornell.jsonl")).unwrap();
    file.lock().unwrap();
    let output = place.sweep(&["-o", "out"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(
        stderr(&output).contains("another lumivox writes"),
        "{}",
        stderr(&output)
    );
}
