//! The simulator of the left technique: what is asked of it, and the thread that it works on.

use std::collections::VecDeque;
use std::fmt::Write as _;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError};

use super::beside::Beside;
use crate::gi::SettingError;
use crate::gi::Settings;
use crate::gi::settings::Setting;
use crate::gi::simulator::{Drawing, LitScene, Simulator, SimulatorRow};
use crate::reference::light_surfaces;
use crate::scene::{Light, Scene};

/// What a simulator is made from.
pub(super) struct Start {
    row: &'static SimulatorRow,
    settings: Settings,
    shown: Settings,
    scene: Arc<Scene>,
    /// In place of the scene's.
    lights: Vec<Light>,
}

/// What the thread is to do.
pub(super) enum Order {
    /// Make another simulator.
    Start(Box<Start>),
    /// Carry out one action.
    Act(usize),
    /// Carry out all actions of a run with so many steps.
    Run(u32),
    /// Leave out the actions that have not begun.
    Stop,
    /// Draw this from now on.
    Show(Settings),
}

/// What there is after an order, or after one of its actions.
pub(super) struct Report {
    /// Orders so far.
    orders: u64,
    /// Actions that have not begun.
    pub(super) waiting: usize,
    /// What is known, or why there is no simulator.
    pub(super) known: Result<Known, String>,
}

/// What a simulator tells.
pub(super) struct Known {
    pub(super) figures: Vec<(&'static str, String)>,
    pub(super) drawing: Drawing,
    /// As [`Simulator::most`], by setting.
    pub(super) most: Vec<(&'static str, u32)>,
}

/// What is chosen, and what came back last.
pub(super) struct SimulatorState {
    chosen: Option<Chosen>,
    /// Steps of a whole run.
    pub(super) steps: u32,
    pub(super) report: Option<Report>,
    orders: VecDeque<Order>,
    asked: u64,
    /// What the thread works with: settings, number of the scene, and what is drawn.
    started: Option<(Settings, u64, Settings)>,
}

/// A simulator and its values.
struct Chosen {
    row: &'static SimulatorRow,
    settings: Settings,
    shown: Settings,
}

impl Default for SimulatorState {
    fn default() -> Self {
        SimulatorState {
            chosen: None,
            steps: 8,
            report: None,
            orders: VecDeque::new(),
            asked: 0,
            started: None,
        }
    }
}

impl SimulatorState {
    /// Takes a technique's simulator, with its defaults where it is another one.
    pub(super) fn choose(&mut self, row: &'static SimulatorRow) -> Result<(), SettingError> {
        let known = self.chosen.as_ref().map(|chosen| chosen.row);
        if !known.is_some_and(|known| std::ptr::eq(known, row)) {
            self.chosen = Some(Chosen {
                row,
                settings: SimulatorRow::values(row.settings, &[])?,
                shown: SimulatorRow::values(row.shown, &[])?,
            });
            (self.started, self.report) = (None, None);
        }
        Ok(())
    }

    /// Values of the settings, and of what is shown.
    pub(super) fn values(&self) -> Option<(&'static SimulatorRow, &Settings, &Settings)> {
        let chosen = self.chosen.as_ref()?;
        Some((chosen.row, &chosen.settings, &chosen.shown))
    }

    /// Changes a value, written as on a command line.
    pub(super) fn set(&mut self, name: &str, value: &str) -> Result<(), SettingError> {
        let Some(Chosen {
            row,
            settings,
            shown,
        }) = &mut self.chosen
        else {
            return Ok(());
        };
        let has = |list: &[Setting]| list.iter().any(|setting| setting.name == name);
        let (list, values) = if has(row.shown) {
            (row.shown, shown)
        } else {
            (row.settings, settings)
        };
        let mut pairs: Vec<String> = values
            .iter()
            .map(|(name, value)| format!("{name}={value}"))
            .collect();
        pairs.push(format!("{name}={value}"));
        *values = SimulatorRow::values(list, &pairs)?;
        Ok(())
    }

    /// Asks for something.
    pub(super) fn order(&mut self, order: Order) {
        self.orders.push_back(order);
    }

    /// Makes it anew from what the window shows now.
    pub(super) fn start_over(&mut self) {
        self.started = None;
    }

    /// Whether everything that was asked for is done.
    pub(super) fn is_idle(&self) -> bool {
        let report = self.report.as_ref();
        self.orders.is_empty()
            && self.started.is_some()
            && report.is_some_and(|report| report.orders == self.asked && report.waiting == 0)
    }

    /// What the thread is to be asked for now.
    pub(super) fn next_orders(
        &mut self,
        scene: &(u64, Arc<Scene>),
        lights: &[Light],
    ) -> Vec<Order> {
        let Some(Chosen {
            row,
            settings,
            shown,
        }) = &self.chosen
        else {
            return Vec::new();
        };
        let wanted = (settings.clone(), scene.0, shown.clone());
        let mut orders = Vec::new();
        match &self.started {
            Some((settings, scene, _)) if (settings, scene) == (&wanted.0, &wanted.1) => {}
            _ => orders.push(Order::Start(Box::new(Start {
                row,
                settings: settings.clone(),
                shown: shown.clone(),
                scene: Arc::clone(&scene.1),
                lights: lights.to_vec(),
            }))),
        }
        let is_shown = |(.., shown): &(_, _, Settings)| *shown == wanted.2;
        if orders.is_empty() && !self.started.as_ref().is_some_and(is_shown) {
            orders.push(Order::Show(shown.clone()));
        }
        self.started = Some(wanted);
        orders.extend(self.orders.drain(..));
        self.asked += orders.len() as u64;
        orders
    }

    /// The figures as CSV.
    pub(super) fn table(&self) -> Option<String> {
        let known = self.report.as_ref()?.known.as_ref().ok()?;
        let mut text = String::from("figure,value\n");
        for (name, value) in &known.figures {
            let _ = writeln!(text, "{name},{value}");
        }
        Some(text)
    }
}

/// The thread that runs simulators.
pub(super) type SimulatorWorker = Beside<Order, Report>;

/// Carries out orders as they come; between the actions of a run it looks for newer ones.
pub(super) fn work(receiver: &Receiver<Order>, tell: &dyn Fn(Report)) {
    let mut bench: Result<(Box<dyn Simulator>, &'static SimulatorRow, Settings), String> =
        Err(String::new());
    let (mut orders, mut waiting) = (0, VecDeque::new());
    loop {
        let order = if waiting.is_empty() {
            receiver.recv().map(Some).map_err(|_| ())
        } else {
            match receiver.try_recv() {
                Ok(order) => Ok(Some(order)),
                Err(TryRecvError::Empty) => Ok(None),
                Err(TryRecvError::Disconnected) => Err(()),
            }
        };
        let Ok(order) = order else { return };
        orders += u64::from(order.is_some());
        match order {
            Some(Order::Start(start)) => {
                waiting.clear();
                bench = make(*start);
            }
            Some(Order::Act(action)) => waiting.push_back(action),
            Some(Order::Run(steps)) => {
                let all = bench.iter().flat_map(|bench| bench.0.automatic(steps));
                waiting.extend(all);
            }
            Some(Order::Stop) => waiting.clear(),
            Some(Order::Show(wanted)) => bench.iter_mut().for_each(|(.., shown)| {
                *shown = wanted.clone();
            }),
            None => {
                let action = waiting.pop_front();
                if let (Ok((simulator, _, shown)), Some(action)) = (&mut bench, action) {
                    simulator.act(action, shown);
                }
            }
        }
        tell(Report {
            orders,
            waiting: waiting.len(),
            known: match &bench {
                Ok((simulator, row, shown)) => Ok(Known {
                    figures: simulator.figures(),
                    drawing: simulator.draw(shown),
                    most: row
                        .shown
                        .iter()
                        .filter_map(|setting| Some((setting.name, simulator.most(setting.name)?)))
                        .collect(),
                }),
                Err(problem) => Err(problem.clone()),
            },
        });
    }
}

fn make(start: Start) -> Result<(Box<dyn Simulator>, &'static SimulatorRow, Settings), String> {
    let Start {
        row,
        settings,
        shown,
        mut scene,
        lights,
    } = start;
    if scene.lights != lights {
        let scene = Arc::make_mut(&mut scene);
        scene.lights = lights;
    }
    let lit = LitScene {
        scene: &scene,
        light: |scene, spacing_m| {
            light_surfaces(scene, spacing_m).map_err(|error| error.to_string())
        },
    };
    let made = (row.make)(&settings, &lit)?;
    Ok((made, row, shown))
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, Instant};

    use super::*;
    use crate::gi::simulator::ActionRow;

    /// Counts its actions, each of which takes a while.
    struct Slow(u32);

    const EACH: Duration = Duration::from_millis(5);

    impl Simulator for Slow {
        fn act(&mut self, _action: usize, _shown: &Settings) {
            std::thread::sleep(EACH);
            self.0 += 1;
        }

        fn automatic(&self, steps: u32) -> Vec<usize> {
            vec![0; steps as usize]
        }

        fn figures(&self) -> Vec<(&'static str, String)> {
            vec![("done", self.0.to_string())]
        }

        fn most(&self, _setting: &str) -> Option<u32> {
            None
        }

        fn draw(&self, _shown: &Settings) -> Drawing {
            Drawing {
                title: String::new(),
                legend: String::new(),
                size: [1, 1],
                shapes: Vec::new(),
            }
        }
    }

    static SLOW: SimulatorRow = SimulatorRow {
        summary: "slow",
        settings: &[],
        shown: &[],
        rules: &[],
        actions: &[ActionRow {
            name: "wait",
            help: "waits",
        }],
        make: |_, _| Ok(Box::new(Slow(0))),
    };

    /// More than a test can wait for.
    const STEPS: u32 = 1_000_000;

    fn started() -> Option<SimulatorWorker> {
        let worker = SimulatorWorker::start("simulator", work, Box::new(|| ())).ok()?;
        let none = SimulatorRow::values(&[], &[]).ok()?;
        worker.ask(Order::Start(Box::new(Start {
            row: &SLOW,
            settings: none.clone(),
            shown: none,
            scene: Arc::default(),
            lights: Vec::new(),
        })));
        worker.ask(Order::Run(STEPS));
        Some(worker)
    }

    /// The first report that is as wanted.
    fn until(worker: &SimulatorWorker, is_wanted: impl Fn(&Report) -> bool) -> Report {
        let began = Instant::now();
        loop {
            if let Some(report) = worker.take().filter(|report| is_wanted(report)) {
                return report;
            }
            assert!(began.elapsed() < Duration::from_secs(20), "no such report");
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    fn done(report: &Report) -> u32 {
        let known = report.known.as_ref();
        known.map_or(0, |known| known.figures[0].1.parse().unwrap_or(0))
    }

    #[test]
    fn a_slow_run_can_be_stopped_and_goes_on() {
        let Some(worker) = started() else {
            panic!("the thread does not start")
        };
        until(&worker, |report| done(report) > 3 && report.waiting > 0);
        worker.ask(Order::Stop);
        let stopped = until(&worker, |report| report.waiting == 0);
        let count = done(&stopped);
        assert!(count < STEPS / 2, "{count} actions");
        std::thread::sleep(4 * EACH);
        assert!(worker.take().is_none(), "it goes on after it was stopped");
        worker.ask(Order::Act(0));
        assert_eq!(
            done(&until(&worker, |report| done(report) > count)),
            count + 1
        );
    }

    #[test]
    fn a_slow_run_ends_with_the_window() {
        let Some(worker) = started() else {
            panic!("the thread does not start")
        };
        until(&worker, |report| done(report) > 0);
        let began = Instant::now();
        drop(worker);
        assert!(
            began.elapsed() < 200 * EACH,
            "{} s",
            began.elapsed().as_secs_f64()
        );
    }
}
