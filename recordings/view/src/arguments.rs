//! The command line.

use std::path::PathBuf;

use crate::frame::Marks;

/// How to call the program.
pub const USAGE: &str = "\
usage: stagger-view FILE|- [--save OUT.rrd | --connect URL | --web] [--contacts] [--velocities]
       stagger-view FILE --arrow FOLDER [--every N]

  FILE         a recording (.mcap); `-` reads the stream of a run under way from standard input
  --save       writes a Rerun recording instead of starting a viewer
  --connect    sends to a viewer that runs already, such as rerun+http://127.0.0.1:9876/proxy
  --web        serves the viewer to browsers of this host, until Ctrl-C
  --contacts   draws contacts as lines between the centres, and the particles smaller
  --velocities draws velocities as arrows, the longest of the run six radii long
  --arrow      writes the fields as Arrow files, one for each support, and shows nothing
  --every      steps from one state in them to the next; the start and the last state are always written";

/// What is asked for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Arguments {
    /// The recording; `None` for standard input.
    pub input: Option<PathBuf>,
    /// Where the pictures go.
    pub target: Target,
    /// What is drawn besides.
    pub marks: Marks,
    /// Folder for Arrow files of the fields, and the steps from one state in them to the next; nothing is shown then.
    pub arrow: Option<(PathBuf, u64)>,
}

/// Where the pictures go.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Target {
    /// To a viewer that is started for it.
    Viewer,
    /// To a file.
    File(PathBuf),
    /// To a viewer in a browser, which is served.
    Web,
    /// To a viewer that runs already.
    Connect(String),
}

/// Reads the command line without the program's name; an error is a sentence to print above the usage.
pub fn parse(arguments: impl IntoIterator<Item = String>) -> Result<Arguments, String> {
    let mut arguments = arguments.into_iter();
    let (mut input, mut target, mut marks) = (None, None, Marks::default());
    let (mut folder, mut every) = (None, None);
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().ok_or(format!("`{argument}` needs a value"));
        let chosen = match argument.as_str() {
            "--contacts" => {
                marks.contacts = true;
                continue;
            }
            "--velocities" => {
                marks.velocities = true;
                continue;
            }
            "--every" => {
                let text = value()?;
                let steps = text.parse().ok().filter(|steps: &u64| *steps > 0);
                every = Some(steps.ok_or_else(|| format!("`--every` needs a number of steps, not `{text}`"))?);
                continue;
            }
            "--arrow" => {
                folder = Some(value()?.into());
                continue;
            }
            "--save" => Target::File(value()?.into()),
            "--connect" => Target::Connect(value()?),
            "--web" => Target::Web,
            option if option.len() > 1 && option.starts_with('-') => return Err(format!("unknown option `{option}`")),
            file => {
                if input.replace(file.to_owned()).is_some() {
                    return Err(format!("one recording can be shown at a time; `{file}` is a second one"));
                }
                continue;
            }
        };
        if target.replace(chosen).is_some() {
            return Err("give one of --save, --connect and --web, once".into());
        }
    }
    let input = input.ok_or("a recording is missing")?;
    let input: Option<PathBuf> = (input != "-").then(|| input.into());
    let arrow = folder.map(|folder| (folder, every.unwrap_or(1)));
    match &arrow {
        Some(_) if input.is_none() => return Err("--arrow reads a recording twice: it needs a file".into()),
        Some(_) if target.is_some() => {
            return Err("--arrow shows nothing: it does not go with --save, --connect or --web".into());
        }
        None if every.is_some() => return Err("--every belongs to --arrow".into()),
        _ => {}
    }
    Ok(Arguments { input, target: target.unwrap_or(Target::Viewer), marks, arrow })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(line: &str) -> Result<Arguments, String> {
        parse(line.split_whitespace().map(str::to_owned))
    }

    #[test]
    fn files_streams_and_targets_are_understood() {
        let expected = Arguments {
            input: None,
            target: Target::File("out.rrd".into()),
            marks: Marks { contacts: true, velocities: true },
            arrow: None,
        };
        assert_eq!(parsed("- --save out.rrd --contacts --velocities"), Ok(expected));
        let expected =
            Arguments { input: Some("run.mcap".into()), target: Target::Viewer, marks: Marks::default(), arrow: None };
        assert_eq!(parsed("run.mcap"), Ok(expected.clone()));
        let web = Arguments { target: Target::Web, ..expected.clone() };
        assert_eq!(parsed("run.mcap --web"), Ok(web));
        let expected = Arguments { arrow: Some(("out".into(), 5)), ..expected };
        assert_eq!(parsed("run.mcap --arrow out --every 5"), Ok(expected));
    }

    #[test]
    fn mistakes_are_named() {
        for (line, expected) in [
            ("", "a recording is missing"),
            ("a.mcap b.mcap", "`b.mcap` is a second one"),
            ("a.mcap --save", "`--save` needs a value"),
            ("a.mcap --frames 3", "unknown option `--frames`"),
            ("a.mcap --save x --connect y", "one of --save, --connect and --web"),
            ("a.mcap --web --web", "one of --save, --connect and --web"),
            ("a.mcap --web --arrow y", "shows nothing"),
            ("a.mcap --save x --arrow y", "shows nothing"),
            ("a.mcap --arrow x --every 0", "a number of steps, not `0`"),
            ("a.mcap --every 2", "belongs to --arrow"),
            ("- --arrow x", "needs a file"),
        ] {
            let error = parsed(line).unwrap_err();
            assert!(error.contains(expected), "{line}: {error}");
        }
    }
}
