//! Scenes as no one would write them: the texts of all scenes, torn, doubled, mistyped and filled with what is no value. The
//! parser either reads them or says what is wrong and where; nothing panics. `STAGGER_CASES` sets how many are tried.

use std::sync::LazyLock;

use proptest::{
    collection::vec,
    prelude::*,
    sample::{Index, select},
    test_runner::{Config, TestRunner},
};

use super::run::{Base, Watched, scenes};

/// Texts in the gate.
const CASES: u32 = 5000;

static BASES: LazyLock<Vec<Base>> =
    LazyLock::new(|| scenes("scenes").into_iter().chain(scenes("tests/extremes/scenes")).collect());

/// What may stand where a value is expected.
const VALUES: [&str; 48] = [
    "nan",
    "-inf",
    "1e999",
    "-1e-999",
    "1e308",
    "5e-324",
    "-0.0",
    "0",
    "-1",
    "1",
    "9223372036854775807",
    "9223372036854775808",
    "-9223372036854775808",
    "99999999999999999999999999",
    "0x7fffffffffffffff",
    "0b101",
    "1_000",
    "1__0",
    "007",
    "[]",
    "[[]]",
    "[[], []]",
    "[0]",
    "[0, 0, 0]",
    "[0, 0, 0, 0]",
    "[1e308, -1e308, 1e308]",
    "[[0, 0], [1, 1]]",
    "[nan, 0, 0]",
    "[\"a\", 1, true]",
    "{}",
    "{ a = {} }",
    "{ kind = \"\" }",
    "true",
    "1979-05-27T07:32:00Z",
    "\"\"",
    "\" \"",
    "\"25 parsecs\"",
    "\"1e400 m\"",
    "\"-5 um\"",
    "\"5 kK/(m m)/s^999999999999\"",
    "\"1 m^-99 s^99\"",
    "\"µm\"",
    "\"٣ m\"",
    "\"\\u0000\"",
    "\"\\U0010FFFF\"",
    "'''\n\n'''",
    "\"1 m",
    "",
];

/// Pieces that end up anywhere.
const PIECES: [&str; 20] = [
    "\"",
    "'",
    "[",
    "]]",
    "{",
    "}",
    "=",
    "\n",
    "\r",
    "#",
    ",",
    ".",
    "\u{0}",
    "\u{feff}",
    "é",
    "\u{202e}",
    "👩‍🚀",
    "[particles]\n",
    "[walls.\"\"]\n",
    "a.b.c.d = 1\n",
];

/// One thing done to a text.
#[derive(Clone, Debug)]
enum Change {
    /// A line's value is another.
    Value(Index, &'static str),
    /// The n-th number is another.
    Number(Index, &'static str),
    /// A line is left out, doubled, or comes elsewhere.
    Leave(Index),
    Double(Index),
    Move(Index, Index),
    /// A letter is another, or a piece comes in.
    Letter(Index, char),
    Piece(Index, &'static str),
    /// A byte is another, whatever that makes of it.
    Byte(Index, u8),
    /// The text ends here.
    Cut(Index),
    /// Another scene follows.
    Join(Index),
    /// Brackets within brackets, tables within tables.
    Nest(Index, u16, bool),
}

fn change() -> impl Strategy<Value = Change> {
    let at = any::<Index>;
    prop_oneof![
        6 => (at(), select(&VALUES[..])).prop_map(|(line, value)| Change::Value(line, value)),
        4 => (at(), select(&VALUES[..])).prop_map(|(number, value)| Change::Number(number, value)),
        2 => at().prop_map(Change::Leave),
        2 => at().prop_map(Change::Double),
        2 => (at(), at()).prop_map(|(from, to)| Change::Move(from, to)),
        3 => (at(), any::<char>()).prop_map(|(place, letter)| Change::Letter(place, letter)),
        3 => (at(), select(&PIECES[..])).prop_map(|(place, piece)| Change::Piece(place, piece)),
        2 => (at(), any::<u8>()).prop_map(|(place, byte)| Change::Byte(place, byte)),
        1 => at().prop_map(Change::Cut),
        1 => at().prop_map(Change::Join),
        1 => (at(), 1u16..3000, any::<bool>()).prop_map(|(line, depth, tables)| Change::Nest(line, depth, tables)),
    ]
}

impl Change {
    fn apply(&self, text: String) -> String {
        let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
        if lines.is_empty() {
            lines.push(String::new());
        }
        match self {
            Self::Value(line, value) => {
                let line = line.get(&lines).clone();
                let of = lines.iter_mut().find(|other| **other == line);
                if let (Some(of), Some((name, _))) = (of, line.split_once('=')) {
                    *of = format!("{name}= {value}");
                }
            }
            Self::Number(number, value) => {
                let starts: Vec<usize> = text
                    .char_indices()
                    .scan(' ', |before, (at, letter)| Some((std::mem::replace(before, letter), at, letter)))
                    .filter(|(before, _, letter)| {
                        letter.is_ascii_digit() && !before.is_ascii_alphanumeric() && *before != '.'
                    })
                    .map(|(_, at, _)| at)
                    .collect();
                if starts.is_empty() {
                    return text;
                }
                let start = *number.get(&starts);
                let rest = text[start..].trim_start_matches(|letter: char| letter.is_ascii_digit() || letter == '.');
                return format!("{}{value}{rest}", &text[..start]);
            }
            Self::Leave(line) => drop(lines.remove(line.index(lines.len()))),
            Self::Double(line) => {
                let line = line.index(lines.len());
                lines.insert(line, lines[line].clone());
            }
            Self::Move(from, to) => {
                let line = lines.remove(from.index(lines.len()));
                lines.insert(to.index(lines.len() + 1), line);
            }
            Self::Letter(place, letter) => {
                let mut letters: Vec<char> = text.chars().chain([' ']).collect();
                let place = place.index(letters.len());
                letters[place] = *letter;
                return letters.into_iter().collect();
            }
            Self::Piece(place, piece) => {
                let mut letters: Vec<char> = text.chars().collect();
                let place = place.index(letters.len() + 1);
                letters.splice(place..place, piece.chars());
                return letters.into_iter().collect();
            }
            Self::Byte(place, byte) => {
                let mut bytes = text.into_bytes();
                bytes.push(b' ');
                let place = place.index(bytes.len());
                bytes[place] = *byte;
                return String::from_utf8_lossy(&bytes).into_owned();
            }
            Self::Cut(place) => {
                let letters: Vec<char> = text.chars().collect();
                return letters[..place.index(letters.len() + 1)].iter().collect();
            }
            Self::Join(scene) => return text + "\n" + &scene.get(&BASES).text,
            Self::Nest(line, depth, tables) => {
                let depth = usize::from(*depth);
                let nested = if *tables {
                    format!("[{}x]", "a.".repeat(depth))
                } else {
                    format!("seed = {}{}", "[".repeat(depth), "]".repeat(depth))
                };
                lines.insert(line.index(lines.len()), nested);
            }
        }
        lines.join("\n")
    }
}

/// What must hold of a text, whatever it is.
fn check(base: &Base, text: &str, sets: &[(String, String)]) -> Result<(), TestCaseError> {
    let _watched = Watched::new(format!("{sets:?} {text}"));
    let changed = Base { name: base.name.clone(), text: text.to_owned(), folder: base.folder.clone() };
    match changed.parse(&sets.to_vec()) {
        Ok(scene) => {
            let wrong = scene.effective.iter().find(|value| value.si.iter().any(|number| !number.is_finite()));
            prop_assert!(wrong.is_none(), "in effect is {wrong:?}");
        }
        Err(problems) => {
            prop_assert!(!problems.list.is_empty(), "refused without a problem");
            // A file that ends without a line break ends on the line after its last.
            let lines = text.lines().count() + 1;
            for problem in &problems.list {
                prop_assert!(!problem.message.trim().is_empty(), "no reason: {problem:?}");
                let set = sets.iter().any(|(key, _)| problem.location == format!("--set {key}"));
                let line = problem.location.strip_prefix(&format!("{}.toml:", base.name));
                let line = line.and_then(|line| line.parse::<usize>().ok());
                prop_assert!(set || line.is_some_and(|line| (1..=lines).contains(&line)), "no place: {problem:?}");
            }
        }
    }
    Ok(())
}

fn runner() -> TestRunner {
    let cases = std::env::var("STAGGER_CASES").ok().and_then(|text| text.parse().ok()).unwrap_or(CASES);
    TestRunner::new(Config { cases, failure_persistence: None, ..Config::default() })
}

#[test]
fn no_text_panics_and_every_mistake_has_a_place() {
    let texts = (any::<Index>(), vec(change(), 1..6));
    runner()
        .run(&texts, |(scene, changes)| {
            let base = scene.get(&BASES);
            let text = changes.iter().fold(base.text.clone(), |text, change| change.apply(text));
            check(base, &text, &[])
        })
        .unwrap_or_else(|error| panic!("{error}"));
}

#[test]
fn no_override_panics_and_every_mistake_has_a_place() {
    let known: Vec<String> = BASES
        .iter()
        .flat_map(|base| base.parse(&Vec::new()).unwrap_or_else(|problems| panic!("{problems}")).effective)
        .map(|value| value.path)
        .collect();
    let key = prop_oneof![select(known), "[a-z.]{0,12}", any::<String>()];
    let value = prop_oneof![select(&VALUES[..]).prop_map(str::to_owned), any::<String>()];
    runner()
        .run(&(any::<Index>(), vec((key, value), 1..4)), |(scene, sets)| {
            let base = scene.get(&BASES);
            check(base, &base.text, &sets)
        })
        .unwrap_or_else(|error| panic!("{error}"));
}
