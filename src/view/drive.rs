//! Carries out scripts: sets what the panels set, or does with the mouse and the keys what a hand
//! does, one action after the other.

use std::collections::VecDeque;
use std::path::Path;
use std::time::{Duration, Instant};

use egui::{Event, Key, Modifiers, PointerButton, Pos2, RawInput, pos2};
use egui_file_dialog::DialogState;
use glam::Vec3;

use super::ViewError;
use super::app::{App, LOOK_PERIOD};
use super::beam::{figure_table, table};
use super::panels::SECTIONS;
use super::script::{Action, Line};
use super::session::{Choice, Compare};
use super::simulator::Order;
use super::suit::Suit;
use super::views;
use super::window::Window;
use crate::frame::Traced;
use crate::gi::registry::find;
use crate::output::write_text;
use crate::scene::Light;
use crate::text::{counted, quoted};

/// How long an action may wait for what it is about.
const PATIENCE: Duration = Duration::from_secs(240);

/// How often a delay is measured.
const LATENCIES: usize = 41;

/// How long for a size that no window manager grants.
const RESIZE_PATIENCE: Duration = Duration::from_secs(10);

/// How long for what a hand outside of the script is to do.
const HAND_PATIENCE: Duration = Duration::from_secs(30);

/// A script on its way.
pub(super) struct Driver {
    rest: VecDeque<Line>,
    /// When the action at the front began, and what was so then.
    began: Option<Began>,
    events: Vec<Event>,
    dropped: Vec<std::path::PathBuf>,
    memory: Option<f64>,
    holds: bool,
    /// Whether the button of a drag was let go.
    is_released: bool,
    latency: Latency,
}

/// The pointer turns the camera again and again; how soon that is seen.
#[derive(Default)]
struct Latency {
    /// When it was last moved: the frame, and the job that was asked for before.
    moved: Option<(u64, Option<u64>)>,
    /// When each frame since began.
    began: Vec<Instant>,
    /// For each time: frames until the picture was seen, and the number of frames among them that
    /// began after it was ready.
    seen: Vec<[u64; 2]>,
}

#[derive(Clone, Copy)]
struct Began {
    at: Instant,
    frames: u64,
    pictures: u64,
    /// How many frames this action has seen.
    turn: u32,
    /// Longest time between two frames.
    gap: Duration,
    /// For how long neither the window nor the render thread had anything to do.
    idle: Duration,
    last: Instant,
}

/// Whether an action is over.
enum Step {
    Done,
    Wait,
}

impl Driver {
    pub(super) fn new(script: VecDeque<Line>) -> Self {
        Driver {
            rest: script,
            began: None,
            events: Vec::new(),
            dropped: Vec::new(),
            memory: None,
            holds: false,
            is_released: false,
            latency: Latency::default(),
        }
    }

    fn front(&self) -> Option<&Action> {
        self.rest.front().map(|line| &line.action)
    }

    /// What the script's hands do in this frame.
    pub(super) fn add_input(&mut self, input: &mut RawInput) {
        // Only the script moves the mouse.
        input.events.retain(|event| {
            !matches!(
                event,
                Event::PointerMoved(_) | Event::PointerGone | Event::MouseMoved(_)
            )
        });
        input.events.append(&mut self.events);
        input
            .dropped_files
            .extend(self.dropped.drain(..).map(|path| egui::DroppedFile {
                path: Some(path),
                ..Default::default()
            }));
        input.focused = true;
    }

    /// Whether something is being dragged.
    pub(super) fn holds(&self) -> bool {
        self.holds
    }

    /// Whether the window is to draw only what it would draw without a script.
    pub(super) fn lets_window_alone(&self) -> bool {
        matches!(self.front(), Some(Action::Settled(_)))
    }

    /// How long a picture is waited for where frames are counted and not time: a machine that is
    /// busy must not count.
    pub(super) fn picture_patience(&self) -> Option<Duration> {
        matches!(self.front(), Some(Action::Latency(_))).then_some(PATIENCE)
    }

    fn button(&mut self, at: Pos2, pressed: bool) {
        self.events.push(Event::PointerMoved(at));
        self.events.push(Event::PointerButton {
            pos: at,
            button: PointerButton::Primary,
            pressed,
            modifiers: Modifiers::NONE,
        });
    }
}

impl App {
    /// One turn of the action at the front; an error ends the script.
    pub(super) fn drive(&mut self) -> Result<(), ViewError> {
        let now = Instant::now();
        let (frames, pictures) = (self.frames, self.session.pictures());
        let is_busy = self.worker.is_busy();
        let Some(driver) = &mut self.driver else {
            return Ok(());
        };
        let Some(Line { text, action }) = driver.rest.front().cloned() else {
            self.closing = true;
            return Ok(());
        };
        let began = driver.began.get_or_insert(Began {
            at: now,
            frames,
            pictures,
            turn: 0,
            gap: Duration::ZERO,
            idle: Duration::ZERO,
            last: now,
        });
        began.gap = began.gap.max(now - began.last);
        if !is_busy {
            // Longer is not idleness: the window, or the machine, was at work meanwhile.
            began.idle += (now - began.last).min(2 * LOOK_PERIOD);
        }
        began.last = now;
        let current = *began;
        began.turn += 1;
        driver.holds = false;
        let failed = |problem: String| ViewError::Script {
            action: text.clone(),
            problem,
        };
        let patience = if matches!(action, Action::Frames(_)) {
            10 * PATIENCE
        } else {
            PATIENCE
        };
        match self.act(&action, current).map_err(failed)? {
            Step::Done => {
                eprintln!(
                    "script: {text}: {:.2} s",
                    current.at.elapsed().as_secs_f64()
                );
                if let Some(driver) = &mut self.driver {
                    driver.rest.pop_front();
                    driver.began = None;
                }
            }
            Step::Wait if current.at.elapsed() > patience => {
                let why = self
                    .session
                    .problem
                    .clone()
                    .unwrap_or_else(|| "what it waits for did not come".to_owned());
                return Err(failed(why));
            }
            Step::Wait => {}
        }
        Ok(())
    }

    fn act(&mut self, action: &Action, began: Began) -> Result<Step, String> {
        match action {
            Action::Frames(_)
            | Action::Still
            | Action::Reference(_)
            | Action::Responsive(..)
            | Action::Latency(_) => self.act_wait(action, began),
            Action::Until(wanted) => {
                let is_so = self.state().contains(wanted);
                if !is_so && began.at.elapsed() > HAND_PATIENCE {
                    return Err(format!("the window is so: {}", self.state().join(", ")));
                }
                Ok(if is_so { Step::Done } else { Step::Wait })
            }
            Action::Suit(side) => self.act_suit(*side, began),
            Action::Settled(seconds) => self.act_settled(*seconds, began.idle),
            Action::Load(_) | Action::Drop(_) | Action::Opened(_) => self.act_scene(action, began),
            Action::Resize(..)
            | Action::Minimised(_)
            | Action::Fullscreen(_)
            | Action::Vsync(_)
            | Action::Scale(_) => self.act_window(action, began),
            Action::Divider(_) | Action::Drag(..) | Action::Key(_) | Action::Type(_) => {
                self.act_hands(action, began)
            }
            Action::Copy(..)
            | Action::Shader(_)
            | Action::Save(_)
            | Action::Command(_)
            | Action::Screenshot(_) => self.act_files(action, began),
            Action::MemoryMark | Action::MemoryCheck(_) => self.act_memory(action),
            Action::Beam(..) | Action::BeamList(_) | Action::BeamOff => {
                self.act_beam(action, began)
            }
            Action::SimulatorSet(..)
            | Action::SimulatorAct(_)
            | Action::SimulatorRun(_)
            | Action::SimulatorOver
            | Action::SimulatorList(_) => self.act_simulator(action, began),
            Action::Close => {
                self.closing = true;
                Ok(Step::Done)
            }
            other => self.act_session(other).map(|()| Step::Done),
        }
    }

    fn act_suit(&mut self, side: usize, began: Began) -> Result<Step, String> {
        let choice = &mut self.session.choices[side];
        if began.turn == 0 {
            choice.suit = Suit::Wanted;
        }
        Ok(match choice.suit {
            Suit::Said(_) => Step::Done,
            _ => Step::Wait,
        })
    }

    fn act_wait(&mut self, action: &Action, began: Began) -> Result<Step, String> {
        let done = match action {
            Action::Frames(count) => {
                self.session.continuous = self.frames - began.frames < u64::from(*count);
                // The pictures of the frames are there too: at least one, however slow.
                let pictures = self.session.pictures() - began.pictures;
                let is_done = !self.session.continuous && pictures > 0;
                if is_done {
                    eprintln!("frames: {count}, and {pictures} pictures came");
                }
                is_done
            }
            Action::Still => {
                if self.session.has_failed() {
                    return Err(self.session.problem.clone().unwrap_or_default());
                }
                began.turn > 1 && self.session.is_still()
            }
            Action::Reference(samples) => {
                // It rests there, so that a picture of it is always the same.
                self.session.set_most_samples((*samples).max(1));
                self.session
                    .truth
                    .as_ref()
                    .is_some_and(|truth| truth.samples >= *samples)
                    && began.turn > 2
            }
            Action::Responsive(seconds, rate) => {
                self.session.controls.drag([1.0, 0.0]);
                let elapsed = began.at.elapsed().as_secs_f64();
                let drawn = (self.frames - began.frames) as f64 / elapsed;
                if elapsed >= *seconds && drawn < *rate {
                    return Err(format!(
                        "{drawn:.1} frames a second, the longest gap {:.0} ms",
                        began.gap.as_secs_f64() * 1e3
                    ));
                }
                if elapsed >= *seconds {
                    eprintln!(
                        "responsive: {drawn:.1} frames a second, the longest gap {:.0} ms",
                        began.gap.as_secs_f64() * 1e3
                    );
                }
                if let Some(driver) = &mut self.driver {
                    driver.holds = elapsed < *seconds;
                }
                elapsed >= *seconds
            }
            Action::Latency(most) => return self.act_latency(*most, began.turn),
            _ => true,
        };
        Ok(if done { Step::Done } else { Step::Wait })
    }

    fn act_scene(&mut self, action: &Action, began: Began) -> Result<Step, String> {
        let done = match action {
            Action::Load(source) => {
                if began.turn == 0 {
                    self.open(source.into());
                }
                self.loading.is_none() && self.session.source.to_str() == Some(source)
            }
            Action::Drop(path) => {
                if began.turn == 0
                    && let Some(driver) = &mut self.driver
                {
                    driver.dropped.push(path.clone());
                }
                self.loading.is_none() && Path::new(&self.session.source) == path
            }
            Action::Opened(path) => {
                self.loading.is_none() && Path::new(&self.session.source).ends_with(path)
            }
            _ => true,
        };
        let problem = self
            .session
            .any_problem()
            .cloned()
            .filter(|_| self.loading.is_none() && began.turn > 2);
        match problem {
            Some(problem) if !done => Err(problem),
            _ => Ok(if done { Step::Done } else { Step::Wait }),
        }
    }

    /// Counts frames, not time: how long the window waits for a quick picture is not limited
    /// meanwhile, so that a busy machine changes nothing.
    fn act_latency(&mut self, most: u32, turn: u32) -> Result<Step, String> {
        let picture = self.panels.picture;
        let (job, seen, frame, frame_began) = (
            self.session.asked_job(),
            self.seen,
            self.frames,
            self.frame_began,
        );
        let Some(driver) = &mut self.driver else {
            return Ok(Step::Done);
        };
        driver.holds = true;
        // Two places that are farther apart than a hand trembles: a drag at once.
        let at = |index: usize| {
            picture
                .left_center()
                .lerp(picture.right_center(), [0.25, 0.75][index % 2])
        };
        match turn {
            0 => {
                driver.button(at(1), true);
                return Ok(Step::Wait);
            }
            1..=3 => {
                driver.events.push(Event::PointerMoved(at(turn as usize)));
                return Ok(Step::Wait);
            }
            _ => {}
        }
        let latency = &mut driver.latency;
        if let Some((moved, before)) = latency.moved {
            if job == before || seen.map(|seen| seen.job) != job {
                latency.began.push(frame_began);
                return Ok(Step::Wait);
            }
            let Some(seen) = seen else {
                return Ok(Step::Wait);
            };
            let late = latency
                .began
                .iter()
                .filter(|began| **began >= seen.ready)
                .count();
            latency.seen.push([seen.frame - moved, late as u64]);
        }
        if latency.seen.len() < LATENCIES {
            (latency.moved, latency.began) = (Some((frame, job)), Vec::new());
            let to = at(latency.seen.len());
            driver.events.push(Event::PointerMoved(to));
            return Ok(Step::Wait);
        }
        let Latency { seen, .. } = std::mem::take(latency);
        driver.button(at(0), false);
        driver.holds = false;
        let worst = |index: usize| seen.iter().map(|counts| counts[index]).max().unwrap_or(0);
        let (frames, late) = (worst(0), worst(1));
        let text = format!(
            "a picture is seen {frames} frames after the pointer moved, {late} after it was there \
             (the worst of {LATENCIES})"
        );
        eprintln!("latency: {text}");
        if frames.max(late) > u64::from(most) {
            Err(text)
        } else {
            Ok(Step::Done)
        }
    }

    fn act_window(&mut self, action: &Action, began: Began) -> Result<Step, String> {
        let Some(window) = &mut self.window else {
            return Ok(Step::Wait);
        };
        let is_first = began.turn == 0;
        let done = match action {
            Action::Resize(width, height) => {
                if is_first {
                    let _ = window
                        .raw
                        .request_inner_size(winit::dpi::PhysicalSize::new(*width, *height));
                }
                let [w, h] = window.size();
                if began.at.elapsed() > RESIZE_PATIENCE {
                    return Err(format!("the window is {w}x{h} px"));
                }
                [w, h] == [*width, *height] && self.frames > began.frames + 1
            }
            Action::Minimised(on) => {
                if is_first {
                    window.raw.set_minimized(*on);
                }
                if began.at.elapsed() > RESIZE_PATIENCE {
                    return Err(String::from(
                        "the window manager (is there one?) leaves it as it is",
                    ));
                }
                window.is_minimised() == *on && began.at.elapsed() > Duration::from_millis(200)
            }
            Action::Fullscreen(on) => {
                if is_first {
                    window.set_fullscreen(*on);
                }
                self.frames > began.frames + 3
            }
            Action::Vsync(on) => {
                window.painter.set_vsync(*on);
                self.remembered.vsync = window.painter.vsync();
                self.frames > began.frames + 1
            }
            Action::Scale(scale) => {
                window.set_scale(&self.ctx, *scale);
                self.frames > began.frames + 1
            }
            _ => true,
        };
        Ok(if done { Step::Done } else { Step::Wait })
    }

    /// The mouse and the keys, a frame for each of their events.
    fn act_hands(&mut self, action: &Action, began: Began) -> Result<Step, String> {
        let picture = self.panels.picture;
        let at = |x: f32, y: f32| {
            pos2(
                picture.left() + x * picture.width(),
                picture.top() + y * picture.height(),
            )
        };
        let divider = self.session.divider;
        let Some(driver) = &mut self.driver else {
            return Ok(Step::Done);
        };
        let (from, to) = match action {
            Action::Divider(x) => (at(divider, 0.3), at(*x, 0.3)),
            Action::Drag([x0, y0, x1, y1], _) => (at(*x0, *y0), at(*x1, *y1)),
            Action::Key(name) => {
                // A character stands for the key that makes it.
                let Some(key) = Key::from_name(name) else {
                    return Err("there is no such key".to_owned());
                };
                let event = |pressed| Event::Key {
                    key,
                    physical_key: None,
                    pressed,
                    repeat: false,
                    modifiers: Modifiers::NONE,
                };
                driver.events.push(event(began.turn == 0));
                return Ok(if began.turn == 0 {
                    Step::Wait
                } else {
                    Step::Done
                });
            }
            Action::Type(text) => {
                driver.events.push(Event::Text(text.clone()));
                return Ok(Step::Done);
            }
            _ => return Ok(Step::Done),
        };
        let way = match action {
            Action::Drag(_, Some(seconds)) => began.at.elapsed().as_secs_f32() / seconds,
            _ => began.turn.saturating_sub(1) as f32 / 8.0,
        };
        driver.holds = true;
        match began.turn {
            0 => driver.events.push(Event::PointerMoved(from)),
            1 => driver.button(from, true),
            _ if driver.is_released => {
                (driver.holds, driver.is_released) = (false, false);
                driver.events.push(Event::PointerGone);
                return match action {
                    Action::Divider(x) if (self.session.divider - x).abs() > 0.02 => {
                        Err(format!("the divider is at {}", self.session.divider))
                    }
                    _ => Ok(Step::Done),
                };
            }
            _ if way <= 1.0 => driver.events.push(Event::PointerMoved(from.lerp(to, way))),
            _ => {
                driver.button(to, false);
                driver.is_released = true;
            }
        }
        Ok(Step::Wait)
    }

    /// How the window is, in the words of `until`.
    fn state(&self) -> Vec<String> {
        let (session, panels) = (&self.session, &self.panels);
        let switch = |name: &str, on: bool| format!("{name} {}", if on { "on" } else { "off" });
        let is_fullscreen = self.window.as_ref().is_some_and(Window::is_fullscreen);
        let mut state = vec![
            format!("compare {}", session.compare.name()),
            format!("camera {}", session.controls.mode.name()),
            format!("view {}", session.view_name()),
            format!("exposure {}", session.exposure_ev),
            switch("panels", self.remembered.panels),
            switch("help", panels.help),
            switch("beam", session.beam.place.is_some()),
            switch("dialog", *panels.dialog.state() == DialogState::Open),
            switch("fullscreen", is_fullscreen),
        ];
        let set = session.controls.bookmarks.iter().enumerate();
        state.extend(
            set.filter(|(_, camera)| camera.is_some())
                .map(|(slot, _)| format!("bookmark {}", slot + 1)),
        );
        state
    }

    /// Compares what is drawn, what is said of it and what is to be drawn.
    fn act_settled(&self, seconds: f64, idle: Duration) -> Result<Step, String> {
        let (session, told) = (&self.session, &self.panels.told);
        let shown: Vec<Option<[u32; 2]>> = (0..session.pane_count())
            .map(|side| self.canvas.size(side))
            .collect();
        for [width, height] in shown.iter().flatten() {
            let size = format!("{width}×{height} ");
            if !told.text.is_empty() && !told.text.contains(&size) {
                return Err(format!(
                    "{width}×{height} px are shown under the status {}",
                    quoted(&told.text)
                ));
            }
        }
        let is_map = views::VIEWS[session.view].is_map();
        let is_full = is_map || shown.iter().all(|size| *size == Some(session.size));
        if told.is_at_rest && !is_full {
            return Err(format!("{} are shown under a green dot", sizes(&shown)));
        }
        if told.is_at_rest {
            return Ok(Step::Done);
        }
        if idle.as_secs_f64() > seconds {
            return Err(format!(
                "after {:.2} s with nothing to do, {} of {} are shown under the status {}",
                idle.as_secs_f64(),
                sizes(&shown),
                sizes(&[Some(session.size)]),
                quoted(&told.text)
            ));
        }
        Ok(Step::Wait)
    }

    fn act_files(&mut self, action: &Action, began: Began) -> Result<Step, String> {
        let failed = |path: &Path, error: std::io::Error| format!("{}: {error}", path.display());
        match action {
            Action::Copy(from, to) => {
                self.session.shader = None;
                std::fs::copy(from, to).map_err(|error| failed(to, error))?;
            }
            Action::Shader(wanted) => match &self.session.shader {
                Some(Ok(_)) if *wanted => {}
                Some(Err(_)) if !wanted => {}
                Some(Err(problem)) => return Err(problem.clone()),
                Some(Ok(text)) => return Err(text.clone()),
                None => return Ok(Step::Wait),
            },
            Action::Save(path) => self.save(path)?,
            Action::Command(path) => write_text(path, &self.command_words()?.join("\n"))
                .map_err(|error| failed(path, error))?,
            Action::Screenshot(path) => {
                // What was just changed is laid out in the first frame and drawn as it will stay in
                // the second.
                if began.turn == 3 {
                    self.capture = Some(path.clone());
                }
                return Ok(if began.turn > 3 && self.capture.is_none() {
                    Step::Done
                } else {
                    Step::Wait
                });
            }
            _ => {}
        }
        Ok(Step::Done)
    }

    fn act_beam(&mut self, action: &Action, began: Began) -> Result<Step, String> {
        let beam = &mut self.session.beam;
        match action {
            Action::Beam(place, axis) if began.turn == 0 => {
                (beam.place, beam.follows, beam.axis, beam.answer) =
                    (Some(*place), false, *axis, None);
                beam.asked = None;
                return Ok(Step::Wait);
            }
            Action::BeamOff => {
                beam.place = None;
                return Ok(Step::Done);
            }
            _ => {}
        }
        let Some(answer) = self.session.traced() else {
            return Ok(Step::Wait);
        };
        match (action, &answer.found) {
            (_, Err(problem)) => Err(problem.clone()),
            (Action::BeamList(path), Ok(Traced::Beam(beam))) => {
                write_text(path, &table(beam))
                    .map_err(|error| format!("{}: {error}", path.display()))?;
                Ok(Step::Done)
            }
            (Action::BeamList(path), Ok(Traced::Figures(figures))) => {
                write_text(path, &figure_table(figures))
                    .map_err(|error| format!("{}: {error}", path.display()))?;
                Ok(Step::Done)
            }
            (Action::BeamList(_), Ok(_)) => Err(String::from("there is no beam")),
            _ => Ok(Step::Done),
        }
    }

    fn act_simulator(&mut self, action: &Action, began: Began) -> Result<Step, String> {
        let entry = self.session.choices[0].entry;
        let state = &mut self.session.simulator;
        if entry.simulator.is_none() {
            return Err(format!("{} has no simulator", entry.name));
        }
        if !self.panels.shows_simulator() {
            return Err("the section of the simulator is not open".to_owned());
        }
        let Some((row, ..)) = state.values() else {
            return Ok(Step::Wait);
        };
        if began.turn == 0 {
            match action {
                Action::SimulatorSet(name, value) => {
                    state.set(name, value).map_err(|error| error.to_string())?;
                }
                Action::SimulatorAct(name) => {
                    let known = row.actions.iter().position(|action| action.name == name);
                    let known = known.ok_or_else(|| format!("there is no action {name}"))?;
                    state.order(Order::Act(known));
                }
                Action::SimulatorRun(steps) => state.order(Order::Run(*steps)),
                Action::SimulatorOver => state.start_over(),
                _ => {}
            }
        }
        if began.turn < 2 || !state.is_idle() {
            return Ok(Step::Wait);
        }
        if let Some(Err(problem)) = state.report.as_ref().map(|report| &report.known) {
            return Err(problem.clone());
        }
        if let (Action::SimulatorList(path), Some(table)) = (action, state.table()) {
            write_text(path, &table).map_err(|error| format!("{}: {error}", path.display()))?;
        }
        Ok(Step::Done)
    }

    fn act_memory(&mut self, action: &Action) -> Result<Step, String> {
        let Some(now) = resident_bytes() else {
            eprintln!("memory: this system does not tell a process's memory");
            return Ok(Step::Done);
        };
        let Some(driver) = &mut self.driver else {
            return Ok(Step::Done);
        };
        match (action, driver.memory) {
            (Action::MemoryCheck(percent), Some(before)) => {
                let growth = (now / before - 1.0) * 100.0;
                eprintln!(
                    "memory: {:.1} MiB before, {:.1} MiB now, {growth:+.2}%",
                    before / 1048576.0,
                    now / 1048576.0
                );
                if growth > *percent {
                    Err(format!("it grew by {growth:.2}%"))
                } else {
                    Ok(Step::Done)
                }
            }
            _ => {
                driver.memory = Some(now);
                Ok(Step::Done)
            }
        }
    }

    fn act_session(&mut self, action: &Action) -> Result<(), String> {
        let session = &mut self.session;
        match action {
            Action::Panels(on) => self.remembered.panels = *on,
            Action::Help(on) => self.panels.help = *on,
            Action::Times(on) => self.panels.times = *on,
            Action::Browse => self.panels.browse(&self.ctx),
            Action::Section(name) => {
                let known = SECTIONS
                    .iter()
                    .any(|section| section.eq_ignore_ascii_case(name));
                if !known && name != "none" {
                    return Err(format!(
                        "there is no section {name}; there are: {}",
                        SECTIONS.join(", ")
                    ));
                }
                self.panels.open = SECTIONS.map(|section| section.eq_ignore_ascii_case(name));
            }
            Action::Technique(side, name, preset) => {
                let entry = find(name).map_err(|error| error.to_string())?;
                session.choices[*side] = Choice::new(entry, preset.as_deref(), &[])
                    .map_err(|error| error.to_string())?;
            }
            Action::Set(side, key, value) => {
                let choice = &mut session.choices[*side];
                let mut all = choice.entry.all_settings();
                let setting = all.find(|setting| setting.name == key);
                let setting =
                    setting.ok_or_else(|| format!("{} has no setting {key}", choice.entry.name))?;
                choice.set.insert(setting.name, value.clone());
                choice.update();
                return choice.problem.clone().map_or(Ok(()), Err);
            }
            Action::Compare(name) => {
                session.compare = match name.as_str() {
                    "single" => Compare::Single,
                    "split" => Compare::Split,
                    "difference" => Compare::Difference,
                    _ => return Err("write single, split or difference".to_owned()),
                }
            }
            Action::View(name, layer) => {
                (session.view, session.layer) = (
                    views::find(name).ok_or_else(|| format!("there is no view {name}"))?,
                    *layer,
                )
            }
            Action::Exposure(ev) => session.exposure_ev = *ev,
            Action::Component(name, on) => {
                let c = &mut session.components;
                match name.as_str() {
                    "direct" => c.direct = *on,
                    "diffuse" => c.diffuse = *on,
                    "specular" => c.specular = *on,
                    "emission" => c.emission = *on,
                    "visibility" => c.visibility = *on,
                    _ => {
                        return Err(
                            "write direct, diffuse, specular, emission or visibility".to_owned()
                        );
                    }
                }
            }
            Action::MoveLight(index, by) => match session.lights.get_mut(*index) {
                Some(Light::Point { position, .. } | Light::Spot { position, .. }) => {
                    *position += Vec3::from(*by)
                }
                Some(Light::Directional { direction, .. }) => {
                    *direction = (*direction + Vec3::from(*by)).normalize()
                }
                None => {
                    return Err(format!(
                        "the scene has {}",
                        counted(session.lights.len(), "light")
                    ));
                }
            },
            Action::AddLight => {
                let position = session.controls.camera.eye;
                session.lights.push(Light::Point {
                    position,
                    intensity: Vec3::ONE,
                });
            }
            _ => return Err(String::from("it is not carried out here")),
        }
        Ok(())
    }
}

/// Sizes of pictures, in words.
fn sizes(shown: &[Option<[u32; 2]>]) -> String {
    let words = shown.iter().map(|size| match size {
        Some([width, height]) => format!("{width}×{height} px"),
        None => "nothing".to_owned(),
    });
    words.collect::<Vec<_>>().join(" and ")
}

/// Resident memory of this process (bytes); `None` where the system does not tell.
fn resident_bytes() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    line.split_whitespace()
        .next()?
        .parse::<f64>()
        .ok()
        .map(|kib| kib * 1024.0)
}
