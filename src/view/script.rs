//! Scripts that drive the window: for tests, and for the pictures of the manual.
//!
//! One action a line, `#` begins a comment. An action that waits is over when what it waits for is
//! there, or fails after its time.

use std::collections::VecDeque;
use std::path::PathBuf;

use crate::gi::inspect::BeamAxis;
use crate::text::quoted;

/// One action of a script that drives the window.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// `frames N`: draw N frames of the window, and ask for a new picture all the time.
    Frames(u32),
    /// `still`: wait until the full picture is there.
    Still,
    /// `reference N`: wait until the reference has N samples a pixel, after which it rests.
    Reference(u32),
    /// `resize W H`: ask for this size of the window (px), and wait for it.
    Resize(u32, u32),
    /// `minimise`, `restore`.
    Minimised(bool),
    /// `fullscreen on|off`.
    Fullscreen(bool),
    /// `vsync on|off`.
    Vsync(bool),
    /// `scale X`: pixels of a point.
    Scale(f32),
    /// `panels on|off`.
    Panels(bool),
    /// `section NAME`: open this section of the panels and close the others.
    Section(String),
    /// `help on|off`: the keyboard overview.
    Help(bool),
    /// `times on|off`: what is different every time, in the status line.
    Times(bool),
    /// `load SCENE`, and wait for it.
    Load(String),
    /// `technique left|right NAME [PRESET]`.
    Technique(usize, String, Option<String>),
    /// `suit left|right`: choose the settings for the scene, and wait for them.
    Suit(usize),
    /// `set left|right KEY VALUE`.
    Set(usize, String, String),
    /// `compare single|split|difference`.
    Compare(String),
    /// `divider X`: drag it there with the mouse, 0 left to 1 right.
    Divider(f32),
    /// `view NAME [LAYER]`.
    View(String, u32),
    /// `exposure EV`: in stops, 0 for none.
    Exposure(f32),
    /// `component NAME on|off`.
    Component(String, bool),
    /// `drag X0 Y0 X1 Y1 [SECONDS]`: with the left button, shares of the picture; without a time,
    /// in eight steps.
    Drag([f32; 4], Option<f32>),
    /// `settled SECONDS`: leave the window alone until the full picture is drawn; fail where it is
    /// not after so long without work, or where the status line is wrong.
    Settled(f64),
    /// `key NAME`: press and release it, as egui names it.
    Key(String),
    /// `until WHAT`: wait until the window is so, whoever brings it there: `compare`, `view` or
    /// `camera` and a name, `panels`, `help`, `beam`, `dialog` or `fullscreen` and on or off,
    /// `bookmark` and its number, `exposure` and stops.
    Until(String),
    /// `type TEXT`: into what has the focus.
    Type(String),
    /// `browse`: open the dialog for scenes.
    Browse,
    /// `opened FILE`: wait until that is the scene; its end is enough.
    Opened(PathBuf),
    /// `light move INDEX DX DY DZ`: (m).
    MoveLight(usize, [f32; 3]),
    /// `light add`: add a point light at the camera (1 W/sr).
    AddLight,
    /// `beam X Y normal|mirror|diffuse N`: a beam from there, shares of the picture; waits for it.
    Beam([f32; 2], BeamAxis),
    /// `beam list FILE`: its samples, as CSV.
    BeamList(PathBuf),
    /// `beam off`: no beam any more.
    BeamOff,
    /// `simulator set KEY VALUE`.
    SimulatorSet(String, String),
    /// `simulator act NAME`: one action of the simulator, whose section is open; waits for it.
    SimulatorAct(String),
    /// `simulator run STEPS`: all actions; waits for them.
    SimulatorRun(u32),
    /// `simulator over`: start over.
    SimulatorOver,
    /// `simulator list FILE`: its figures, as CSV.
    SimulatorList(PathBuf),
    /// `copy FROM TO`: a file.
    Copy(PathBuf, PathBuf),
    /// `shader ok|error`: wait until a shader was taken or refused since the last such action.
    Shader(bool),
    /// `save FILE`: the left picture, .exr or .png.
    Save(PathBuf),
    /// `command FILE`: the words of the command line that makes the picture, one a line.
    Command(PathBuf),
    /// `screenshot FILE`: the window, as PNG.
    Screenshot(PathBuf),
    /// `memory mark`: remember the process's memory.
    MemoryMark,
    /// `memory check PERCENT`: fail where it has grown by more.
    MemoryCheck(f64),
    /// `responsive SECONDS RATE`: move the camera all the time; fail where the window is drawn less
    /// often than RATE times a second.
    Responsive(f64, f64),
    /// `latency MOST`: turn the camera by the mouse again and again; fail where a picture is seen
    /// more than MOST frames later.
    Latency(u32),
    /// `drop FILE`: as if dragged from a file manager.
    Drop(PathBuf),
    /// `close`: as if by the window's own button.
    Close,
}

/// A line of a script.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// As it was written.
    pub text: String,
    /// What it asks for.
    pub action: Action,
}

/// A line that is no action.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {} is no action; docs/view.md lists them", quoted(text))]
pub struct ScriptError {
    line: usize,
    text: String,
}

/// Reads a script.
pub fn parse(text: &str) -> Result<VecDeque<Line>, ScriptError> {
    let lines = text
        .lines()
        .enumerate()
        .map(|(index, line)| (index + 1, line.split('#').next().unwrap_or("").trim()));
    lines
        .filter(|(_, line)| !line.is_empty())
        .map(|(line, text)| {
            let text = text.to_owned();
            match action(&text) {
                Some(action) => Ok(Line { text, action }),
                None => Err(ScriptError { line, text }),
            }
        })
        .collect()
}

fn action(text: &str) -> Option<Action> {
    let words: Vec<&str> = text.split_whitespace().collect();
    let number = |word: &str| word.parse::<f32>().ok().filter(|number| number.is_finite());
    let switch = |word: &str| match word {
        "on" => Some(true),
        "off" => Some(false),
        _ => None,
    };
    let side = |word: &str| match word {
        "left" => Some(0),
        "right" => Some(1),
        _ => None,
    };
    Some(match words[..] {
        ["frames", count] => Action::Frames(count.parse().ok()?),
        ["still"] => Action::Still,
        ["reference", samples] => Action::Reference(samples.parse().ok()?),
        ["resize", width, height] => Action::Resize(width.parse().ok()?, height.parse().ok()?),
        ["minimise"] => Action::Minimised(true),
        ["restore"] => Action::Minimised(false),
        ["fullscreen", word] => Action::Fullscreen(switch(word)?),
        ["vsync", word] => Action::Vsync(switch(word)?),
        ["scale", scale] => Action::Scale(number(scale)?),
        ["panels", word] => Action::Panels(switch(word)?),
        ["section", name] => Action::Section(name.to_owned()),
        ["help", word] => Action::Help(switch(word)?),
        ["times", word] => Action::Times(switch(word)?),
        ["load", ..] => Action::Load(text["load".len()..].trim().to_owned()),
        ["technique", which, name] => Action::Technique(side(which)?, name.to_owned(), None),
        ["technique", which, name, preset] => {
            Action::Technique(side(which)?, name.to_owned(), Some(preset.to_owned()))
        }
        ["suit", which] => Action::Suit(side(which)?),
        ["set", which, key, value] => Action::Set(side(which)?, key.to_owned(), value.to_owned()),
        ["compare", name] => Action::Compare(name.to_owned()),
        ["divider", at] => Action::Divider(number(at)?),
        ["view", name] => Action::View(name.to_owned(), 0),
        ["view", name, layer] => Action::View(name.to_owned(), layer.parse().ok()?),
        ["exposure", ev] => Action::Exposure(number(ev)?),
        ["component", name, word] => Action::Component(name.to_owned(), switch(word)?),
        ["drag", a, b, c, d, ref time @ ..] if time.len() <= 1 => Action::Drag(
            [number(a)?, number(b)?, number(c)?, number(d)?],
            match time {
                [seconds] => Some(number(seconds).filter(|seconds| *seconds > 0.0)?),
                _ => None,
            },
        ),
        ["settled", seconds] => Action::Settled(seconds.parse().ok()?),
        ["key", name] => Action::Key(name.to_owned()),
        ["until", ..] => Action::Until(words[1..].join(" ")),
        ["type", ..] => Action::Type(text["type".len()..].trim().to_owned()),
        ["browse"] => Action::Browse,
        ["opened", ..] => Action::Opened(text["opened".len()..].trim().into()),
        ["light", "move", index, x, y, z] => {
            Action::MoveLight(index.parse().ok()?, [number(x)?, number(y)?, number(z)?])
        }
        ["light", "add"] => Action::AddLight,
        ["beam", "off"] => Action::BeamOff,
        ["beam", "list", path] => Action::BeamList(path.into()),
        ["beam", x, y, "normal"] => Action::Beam([number(x)?, number(y)?], BeamAxis::Normal),
        ["beam", x, y, "mirror"] => Action::Beam([number(x)?, number(y)?], BeamAxis::Mirror),
        ["beam", x, y, "diffuse", index] => Action::Beam(
            [number(x)?, number(y)?],
            BeamAxis::Diffuse(index.parse().ok()?),
        ),
        ["simulator", "set", key, value] => Action::SimulatorSet(key.to_owned(), value.to_owned()),
        ["simulator", "act", name] => Action::SimulatorAct(name.to_owned()),
        ["simulator", "run", steps] => Action::SimulatorRun(steps.parse().ok()?),
        ["simulator", "over"] => Action::SimulatorOver,
        ["simulator", "list", path] => Action::SimulatorList(path.into()),
        ["copy", from, to] => Action::Copy(from.into(), to.into()),
        ["shader", "ok"] => Action::Shader(true),
        ["shader", "error"] => Action::Shader(false),
        ["save", path] => Action::Save(path.into()),
        ["command", path] => Action::Command(path.into()),
        ["screenshot", path] => Action::Screenshot(path.into()),
        ["memory", "mark"] => Action::MemoryMark,
        ["memory", "check", percent] => Action::MemoryCheck(percent.parse().ok()?),
        ["responsive", seconds, rate] => {
            Action::Responsive(seconds.parse().ok()?, rate.parse().ok()?)
        }
        ["latency", most] => Action::Latency(most.parse().ok()?),
        ["drop", path] => Action::Drop(path.into()),
        ["close"] => Action::Close,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_actions_comments_or_errors() {
        let script = parse(
            "# all\nframes 120\n\nresize 1 1 # small\ntechnique left svo cones\nload a b.toml\n",
        );
        let wanted = [
            ("frames 120", Action::Frames(120)),
            ("resize 1 1", Action::Resize(1, 1)),
            (
                "technique left svo cones",
                Action::Technique(0, "svo".to_owned(), Some("cones".to_owned())),
            ),
            ("load a b.toml", Action::Load("a b.toml".to_owned())),
        ];
        let wanted = wanted.map(|(text, action)| Line {
            text: text.to_owned(),
            action,
        });
        assert_eq!(script, Ok(VecDeque::from(wanted)));
        assert_eq!(
            parse("still\ndivider nan"),
            Err(ScriptError {
                line: 2,
                text: "divider nan".to_owned()
            })
        );
    }
}
