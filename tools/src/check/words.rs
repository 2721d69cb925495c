//! Texts in both languages.

use std::borrow::Cow;

use clap::ValueEnum;
use serde_json::{json, Value};

use crate::names::Names;
use crate::panel::course::Both;

/// The languages of lessons and their checks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Language {
    /// English
    En,
    /// Deutsch
    De,
}

impl Language {
    /// German where the system speaks it, otherwise English.
    pub(crate) fn of_system() -> Self {
        match sys_locale::get_locale() {
            Some(locale) if locale.to_lowercase().starts_with("de") => Self::De,
            _ => Self::En,
        }
    }
}

/// A number as it is written in German.
pub(super) fn german(number: f64, decimals: usize) -> String {
    format!("{number:.decimals$}").replace('.', ",")
}

/// A text in each language.
#[derive(Clone, Debug)]
pub(super) struct Words {
    en: Cow<'static, str>,
    de: Cow<'static, str>,
}

impl Words {
    pub(super) const fn fixed(en: &'static str, de: &'static str) -> Self {
        Self { en: Cow::Borrowed(en), de: Cow::Borrowed(de) }
    }

    pub(super) fn new(en: impl Into<Cow<'static, str>>, de: impl Into<Cow<'static, str>>) -> Self {
        Self { en: en.into(), de: de.into() }
    }

    pub(super) fn text(&self, language: Language) -> &str {
        match language {
            Language::En => &self.en,
            Language::De => &self.de,
        }
    }

    /// The same with this in place of that.
    pub(super) fn replace(&self, that: &str, this: &str) -> Self {
        Self::new(self.en.replace(that, this), self.de.replace(that, this))
    }

    /// The same with names beside the terminals.
    pub(super) fn named(&self, names: &Names) -> Self {
        Self::new(names.in_sentence(&self.en), names.in_sentence(&self.de))
    }

    /// Both, for a page.
    pub(super) fn json(&self) -> Value {
        json!({"en": self.en, "de": self.de})
    }
}

/// What is still wrong, and what may help.
#[derive(Clone, Debug)]
pub(super) struct Wrong {
    what: Words,
    hint: Option<Words>,
    /// Why it may be no fault of the program.
    note: Option<Box<Words>>,
    /// Whether the program has ended with an error, whose message says more.
    is_an_error: bool,
}

impl Wrong {
    pub(super) fn new(en: impl Into<Cow<'static, str>>, de: impl Into<Cow<'static, str>>) -> Self {
        Self { what: Words::new(en, de), hint: None, note: None, is_an_error: false }
    }

    /// Adds what may help.
    pub(super) fn hint(self, en: &'static str, de: &'static str) -> Self {
        self.advise(Words::fixed(en, de))
    }

    /// The program has ended with an error.
    pub(super) fn of_an_error(mut self) -> Self {
        self.is_an_error = true;
        self
    }

    pub(super) fn is_an_error(&self) -> bool {
        self.is_an_error
    }

    /// The same in place of an earlier hint.
    pub(super) fn advise(mut self, hint: Words) -> Self {
        self.hint = Some(hint);
        self
    }

    /// Adds why it may be no fault of the program.
    pub(super) fn note(mut self, note: Words) -> Self {
        self.note = Some(Box::new(note));
        self
    }

    /// The same with names beside the terminals.
    pub(super) fn named(mut self, names: &Names) -> Self {
        self.what = self.what.named(names);
        self.hint = self.hint.map(|hint| hint.named(names));
        self
    }

    /// What is wrong, in both languages.
    pub(super) fn both(&self) -> Both {
        let text = |language| self.what.text(language).to_owned();
        Both { en: text(Language::En), de: text(Language::De) }
    }

    /// What is wrong and what may help, for a page.
    pub(super) fn json(&self) -> Value {
        let json = |words: Option<&Words>| words.map(Words::json);
        json!({"what": self.what.json(), "hint": json(self.hint.as_ref()), "note": json(self.note.as_deref())})
    }

    pub(super) fn text(&self, language: Language) -> String {
        let begin = match language {
            Language::En => "Hint",
            Language::De => "Tipp",
        };
        let hint = self.hint.as_ref().map(|hint| format!("{begin}: {}", hint.text(language)));
        let note = self.note.as_ref().map(|note| note.text(language).to_owned());
        let what = self.what.text(language).to_owned();
        [Some(what), hint, note].into_iter().flatten().collect::<Vec<_>>().join("\n")
    }
}

/// The result of a check or of a part of it.
pub(super) type Check<T = ()> = Result<T, Wrong>;
