//! A technique whose answer is given, so that what pixels share of it can be judged.

use glam::Vec4;
use lumivox::gi::entry::Entry;
use lumivox::gi::settings::{Domain, Setting};
use lumivox::gi::{Change, Context, Inputs, Inspect, MapNeeds, Needs, Settings, Technique};
use lumivox::graph::{Error, Frame, FrameStats, Image};
use lumivox::render::{Receivers, screen_image};
use std::sync::Arc;

use super::Random;
use super::passes::ANSWER;

/// Its row; no registry has it.
pub static GIVEN: Entry = Entry {
    settings: &[&[
        Setting {
            name: "answer",
            help: "what it answers",
            unit: "",
            domain: Domain::Choice(&["noise", "one", "ramp", "number", "no-number", "marks"]),
            default: "noise",
        },
        Setting {
            name: "specular_interleave",
            help: "what it answers is mirrored too, where this is more than 1",
            unit: "px",
            domain: Domain::Count { min: 1, max: 8 },
            default: "1",
        },
    ]],
    ..Entry::new("given", "answers what it is told to", make)
};

fn make(context: &Context<'_>, settings: &Settings) -> Result<Box<dyn Technique>, Error> {
    Ok(Box::new(Given {
        answer: settings.choice("answer"),
        mirrors: settings.count("specular_interleave") > 1,
        frame: 0,
        diffuse: screen_image(context.gpu, "given.diffuse", context.size)?,
    }))
}

/// What it answers in a frame, row by row.
pub fn answer(kind: &str, frame: u32, [width, height]: [u32; 2]) -> Vec<Vec4> {
    let mut random = Random::new(u64::from(frame) + 1);
    let of = |index: u32| {
        let (x, y) = (index % width, index / width);
        match kind {
            "noise" => Vec4::from([0; 4].map(|_: u32| random.unit())),
            "one" => Vec4::ONE,
            "ramp" => Vec4::new(x as f32, y as f32, (x + y) as f32, 1.0) / 64.0,
            "number" => Vec4::splat(frame as f32),
            // In the third frame alone.
            "no-number" if frame == 2 && x % 7 == 3 => Vec4::new(
                1.0,
                if y % 2 == 0 { f32::NAN } else { f32::INFINITY },
                0.0,
                1.0,
            ),
            "no-number" => Vec4::ONE,
            _ => Vec4::splat(if x < width / 2 { 0.0 } else { 1.0 }),
        }
    };
    (0..width * height).map(of).collect()
}

struct Given {
    answer: &'static str,
    mirrors: bool,
    frame: u32,
    diffuse: Arc<Image>,
}

impl Technique for Given {
    fn needs(&self) -> Needs {
        Needs::maps(MapNeeds::Nothing)
    }

    fn build(&mut self, _: &Context<'_>) -> Result<FrameStats, Error> {
        Ok(FrameStats::default())
    }

    fn follow(&mut self, context: &Context<'_>, change: Change) -> Result<FrameStats, Error> {
        if change == Change::Camera {
            let [width, height, _] = self.diffuse.extent(0);
            let texels = answer(self.answer, self.frame, [width, height]);
            (context.gpu).upload_image(&self.diffuse, 0, 0, bytemuck::cast_slice(&texels))?;
            self.frame += 1;
        }
        Ok(FrameStats::default())
    }

    fn update(&mut self, _: &mut Frame, _: &Inputs<'_>) {}

    fn gather(&mut self, frame: &mut Frame, _: &Inputs<'_>, receivers: &Receivers<'_>) {
        frame
            .pass(&ANSWER)
            .bind("view_depth", receivers.view_depth)
            .bind("given", &self.diffuse)
            .bind("indirect_diffuse", receivers.light)
            .dispatch(receivers.groups());
    }

    fn mirror(&mut self, _: &mut Frame, _: &Inputs<'_>) -> Option<Arc<Image>> {
        self.mirrors.then(|| Arc::clone(&self.diffuse))
    }

    fn shadow_direct(&mut self, frame: &mut Frame, given: &Inputs<'_>) -> bool {
        frame.clear_image("given.no_direct", given.direct, [0.0; 4]);
        true
    }
}

impl Inspect for Given {}
