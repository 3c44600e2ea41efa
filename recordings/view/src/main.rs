//! Shows a stagger recording, or a run under way, in the Rerun viewer.

mod arguments;
mod arrow_files;
mod bounds;
mod faces;
mod frame;
mod layers;
mod layout;
mod plots;
mod sections;
mod show;
#[cfg(test)]
mod testing;
mod walls;
mod web;

use std::{
    error::Error,
    io::{self, Read, Write as _},
    path::Path,
    process::ExitCode,
};

use arguments::Arguments;
use bounds::bounds_m;
use frame::{Marks, Overview};
use layers::{Layers, passing};
use plots::Plots;
use show::{Moment, Show};
use stagger_messages::Verdict;
use stagger_recordings::{
    Messages, Recording, RunInfo, Step, Steps,
    display::{colour_scale as colour, quantities::Spheres},
    messages_from,
};
use walls::Walls;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if arguments.iter().any(|argument| argument == "--help" || argument == "-h") {
        return match writeln!(io::stdout(), "{}", arguments::USAGE) {
            Err(error) if error.kind() != io::ErrorKind::BrokenPipe => ExitCode::FAILURE,
            _ => ExitCode::SUCCESS,
        };
    }
    let arguments = match arguments::parse(arguments) {
        Ok(arguments) => arguments,
        Err(mistake) => {
            eprintln!("error: {mistake}\n{}", arguments::USAGE);
            return ExitCode::from(2);
        }
    };
    match run(&arguments) {
        Ok(code) => code,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &Arguments) -> Result<ExitCode, Box<dyn Error>> {
    if let (Some(path), Some((folder, every))) = (&arguments.input, &arguments.arrow) {
        return arrow(path, folder, *every);
    }
    match &arguments.input {
        Some(path) => {
            let (recording, overview) = survey(path)?;
            let mut player = Player::open(arguments, &recording.info)?;
            if let Some(overview) = overview {
                player.set_up(overview)?;
            }
            player.play(recording.messages()?)?;
        }
        None => {
            let messages = messages_from(io::stdin().lock())?;
            Player::open(arguments, &messages.info)?.play(messages)?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// Writes a recording's fields as Arrow files; 3 where it is cut off or damaged.
fn arrow(recording: &Path, folder: &Path, every: u64) -> Result<ExitCode, Box<dyn Error>> {
    let opened = Recording::open(recording)?;
    let written = arrow_files::write(&opened, folder, every)?;
    for (file, rows) in &written.files {
        match writeln!(io::stdout(), "{rows} rows in {}", file.display()) {
            // A reader that has gone has read enough.
            Err(error) if error.kind() == io::ErrorKind::BrokenPipe => break,
            told => told?,
        }
    }
    if written.complete {
        return Ok(ExitCode::SUCCESS);
    }
    eprintln!("error: {}: {}", recording.display(), written.problem.as_deref().unwrap_or(opened.shortfall()));
    Ok(ExitCode::from(3))
}

/// Reads a recording through for what holds for all its pictures: the range of the colours, the unit, the camera.
fn survey(path: &Path) -> Result<(Recording, Option<Overview>), Box<dyn Error>> {
    let recording = Recording::open(path)?;
    let (mut steps, mut layers) = (Steps::default(), Layers::of(&recording.info));
    let (mut start, mut last) = (None, None::<(bool, Step)>);
    let mut over_time = Vec::new();
    let mut see = |step: Step| {
        let coloured = layers.coloured(&step);
        layers.include(&step, &coloured);
        over_time.extend(passing(&coloured).map(|value| (step.t_s, value)));
        let spheres = Spheres::of(&step).is_some();
        let Some(bounds) = bounds_m(&step) else { return };
        // Where there are particles at some time, the pictures are of these.
        match &last {
            Some((true, _)) if !spheres => {}
            Some((before, _)) if *before == spheres => last = Some((spheres, step)),
            _ => (start, last) = (Some(bounds), Some((spheres, step))),
        }
    };
    for message in recording.messages()? {
        // The second reading says what is wrong with a message.
        if let Some(step) = message.ok().and_then(|message| steps.take(message).step) {
            see(step);
        }
    }
    steps.end().into_iter().for_each(see);
    let overview = last.and_then(|(_, step)| {
        layers.end(&step);
        let overview = Overview::new(&step, layers, start)?;
        Some(match over_at_the_end(&over_time) {
            Some(range_s) => overview.repeating(range_s, start),
            None => overview,
        })
    });
    Ok((recording, overview))
}

/// First and last time, in s, at which one of some values over time is not small beside the largest, where the last is.
fn over_at_the_end(values: &[(f64, f64)]) -> Option<[f64; 2]> {
    const SMALL: f64 = 1e-3;
    let least = SMALL * values.iter().map(|(_, value)| *value).fold(0.0, f64::max);
    let large = |(t_s, value): &(f64, f64)| (*value > least).then_some(*t_s);
    let (first, last) = (values.iter().find_map(large)?, values.iter().rev().find_map(large)?);
    (values.last()?.1 <= least).then_some([first, last])
}

/// Follows a run and shows it.
struct Player {
    show: Show,
    steps: Steps,
    plots: Plots,
    /// `None` until there is something to show.
    overview: Option<Overview>,
    /// The layers of a run of which nothing has been seen.
    layers: Layers,
    /// Whether the colours' range is known to hold for the whole run.
    surveyed: bool,
    walls: Walls,
    marks: Marks,
}

impl Player {
    fn open(arguments: &Arguments, info: &RunInfo) -> Result<Self, Box<dyn Error>> {
        let show = Show::open(&arguments.target, &info.run)?;
        show.text(description(info))?;
        let walls = Walls::of(info).unwrap_or_else(|problem| {
            eprintln!("warning: the walls are not drawn, as the scene cannot be read: {problem}");
            Walls::default()
        });
        let (steps, plots) = (Steps::default(), Plots::default());
        let (layers, marks) = (Layers::of(info), arguments.marks);
        Ok(Self { show, steps, plots, overview: None, layers, surveyed: false, walls, marks })
    }

    fn set_up(&mut self, overview: Overview) -> Result<(), Box<dyn Error>> {
        self.show.arrange(&overview)?;
        self.show.legends(&overview.layers)?;
        self.show.walls(&self.walls.outlines(&overview), overview.view)?;
        self.surveyed = overview.duration_s.is_some();
        self.overview = Some(overview);
        Ok(())
    }

    fn play<R: Read>(mut self, messages: Messages<R>) -> Result<(), Box<dyn Error>> {
        for message in messages {
            let progress = match message {
                Ok(message) => self.steps.take(message),
                Err(error) => {
                    eprintln!("warning: {error}");
                    continue;
                }
            };
            if let Some(outcome) = &progress.outcome {
                self.plots.iteration(outcome);
                if outcome.decision.verdict() == Verdict::Accept {
                    outcome.reports.values().for_each(|report| self.walls.hear(report));
                    let (t_s, step) = (outcome.decision.t_s, outcome.version.step);
                    let points = self.plots.accepted(outcome, self.steps.decisions().ledger());
                    self.show.points(&points, Moment { t_s, step, iteration: outcome.iteration })?;
                }
            }
            if let Some(step) = progress.step {
                self.step(&step)?;
            }
        }
        if let Some(step) = self.steps.end() {
            self.step(&step)?;
        }
        Ok(self.show.finish()?)
    }

    fn step(&mut self, step: &Step) -> Result<(), Box<dyn Error>> {
        if !step.recorded {
            return Ok(());
        }
        if self.overview.is_none() {
            let mut layers = self.layers.clone();
            layers.include(step, &layers.coloured(step));
            if let Some(overview) = Overview::new(step, layers, None) {
                self.set_up(overview)?;
            }
        }
        if let Some(overview) = &mut self.overview {
            let coloured = overview.layers.coloured(step);
            // The pictures of a run under way keep the colours of their time; the legend follows the newest.
            if !self.surveyed && overview.layers.grow(step, &coloured) {
                self.show.legends(&overview.layers)?;
            }
            let iteration = self.steps.decisions().iterations();
            let moment = Moment { t_s: step.t_s, step: step.version.step, iteration };
            let frame = overview.frame(step, &coloured, self.marks);
            self.show.frame(frame, &overview.layers, moment)?;
            self.show.places(self.walls.places(step.t_s, overview.unit.per_metre), moment)?;
            self.show.points(&self.plots.state(step, &coloured), moment)?;
        }
        Ok(())
    }
}

/// What a recording says about its run, in Markdown.
fn description(info: &RunInfo) -> String {
    let mut text =
        format!("**{}** of `{}`, seed {}, recorded by {}\n", info.run, info.scene_file, info.seed, info.program);
    for (key, value) in &info.overrides {
        text += &format!("\n- `{key} = {value}` (set on the command line)");
    }
    for (key, value) in &info.machine {
        text += &format!("\n- {key}: {value}");
    }
    text + &format!("\n\n```toml\n{}\n```\n", info.scene_text.trim_end())
}

#[cfg(test)]
mod tests {
    use super::over_at_the_end;

    #[test]
    fn what_is_over_before_the_end_is_found() {
        let course = [(0.0, 0.0), (1.0, 2.0), (2.0, 0.0), (3.0, 5.0), (4.0, 1e-3)];
        assert_eq!(over_at_the_end(&course), Some([1.0, 3.0]));
        assert_eq!(over_at_the_end(&course[..4]), None, "it goes on");
        assert_eq!(over_at_the_end(&[(0.0, 0.0), (1.0, 0.0)]), None, "it never was");
        assert_eq!(over_at_the_end(&[]), None);
    }
}
