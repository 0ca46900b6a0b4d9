#![no_main]

use std::path::PathBuf;
use std::sync::LazyLock;

use lumivox::measure::records::{Records, read_records};
use lumivox::measure::stress::results::{Results, summary};
use lumivox::measure::stress::{CASES, Record};
use lumivox::measure::chart::{Cost, PictureFolder, Point, Section, Troubles, page};

static FOLDER: LazyLock<PathBuf> = LazyLock::new(lumivox_fuzz::folder);

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let path = FOLDER.join("records.jsonl");
    lumivox_fuzz::write_anew(&path, bytes);
    if let Ok(points) = read_records::<Point>(&path) {
        let sections = Section::sort(points);
        for section in &sections {
            let _ = (section.csv(), section.answer_lines(), section.picks(),
                Cost::ALL.map(|cost| section.standings(cost)));
        }
        let _ = page(&sections, &PictureFolder::of(&FOLDER), &Troubles::default());
    }
    if let Ok(records) = read_records::<Record>(&path) {
        let results: Vec<Results<'_>> =
            CASES.iter().map(|case| Results { case, records: &records }).collect();
        for case in &results {
            let _ = (case.table(), case.csv(), case.charts());
        }
        let _ = summary(&results);
    }
    let _ = Records::<Point>::open(&path);
});
