//! Words as a shell takes them: split from one text, as `--node NODE=COMMAND` takes it, and quoted for one.

/// Splits at white space that is neither quoted nor escaped: `'…'` keeps everything, in `"…"` a backslash escapes `"`
/// and `\`, outside of quotes it escapes any character. Nothing is expanded.
///
/// # Errors
/// A quote that does not end, a backslash at the end, or no word at all; the text says which.
pub fn split(text: &str) -> Result<Vec<String>, String> {
    let mut words = Vec::new();
    let mut word: Option<String> = None;
    let mut characters = text.chars();
    while let Some(character) = characters.next() {
        match character {
            '\'' | '"' => quoted(character, &mut characters, word.get_or_insert_default())?,
            '\\' => {
                let escaped = characters.next().ok_or("a backslash at its end escapes nothing")?;
                word.get_or_insert_default().push(escaped);
            }
            blank if blank.is_whitespace() => words.extend(word.take()),
            other => word.get_or_insert_default().push(other),
        }
    }
    words.extend(word);
    if words.first().is_none_or(String::is_empty) {
        return Err("expected a program and its arguments, such as python3 mine.py".into());
    }
    Ok(words)
}

fn quoted(quote: char, characters: &mut std::str::Chars<'_>, word: &mut String) -> Result<(), String> {
    while let Some(character) = characters.next() {
        match character {
            end if end == quote => return Ok(()),
            '\\' if quote == '"' => match characters.next() {
                Some(escaped @ ('"' | '\\')) => word.push(escaped),
                Some(plain) => word.extend(['\\', plain]),
                None => break,
            },
            other => word.push(other),
        }
    }
    Err(format!("the quote {quote} has no end"))
}

/// A word as it is typed in a shell: in quotes where it has more than letters, digits and what no shell reads otherwise.
pub fn quote(word: &str) -> String {
    let plain = word.chars().all(|letter| letter.is_ascii_alphanumeric() || "._-+=".contains(letter));
    if plain { word.to_owned() } else { format!("'{}'", word.replace('\'', "'\\''")) }
}

#[cfg(test)]
mod tests {
    use super::{quote, split};

    #[test]
    fn words_are_those_of_a_shell() {
        for (text, words) in [
            ("python3  mine.py", &["python3", "mine.py"][..]),
            ("python3 'my folder/mine.py' --x=\"a b\"c", &["python3", "my folder/mine.py", "--x=a bc"]),
            (r#"a\ b "say \"no\" \n" '\' """#, &["a b", r#"say "no" \n"#, r"\", ""]),
        ] {
            assert_eq!(split(text).unwrap(), words);
        }
    }

    #[test]
    fn what_is_no_command_is_told() {
        for (text, message) in
            [("sh 'a", "the quote ' has no end"), ("sh a\\", "backslash"), ("  ", "a program"), ("''", "a program")]
        {
            assert!(split(text).unwrap_err().contains(message), "{text}");
        }
    }

    #[test]
    fn what_is_quoted_is_one_word_again() {
        assert_eq!((quote("none"), quote("a=1e-6")), ("none".into(), "a=1e-6".into()));
        for word in ["{ emissivity = 0.3 }", "it's", "'", "a\\b", "\"x\" y", "$(ls);*"] {
            assert_eq!(split(&quote(word)).unwrap(), [word]);
        }
    }
}
