//! The files of the page. They are part of the program, so it needs none at run time.

/// What a file is, and what is in it.
#[derive(Clone, Copy)]
pub(super) struct File {
    pub(super) name: &'static str,
    pub(super) text: &'static str,
}

macro_rules! files {
    ($($name:literal),+ $(,)?) => {
        /// All files, the page itself first.
        const FILES: &[File] =
            &[$(File { name: $name, text: include_str!(concat!("page/", $name)) }),+];
    };
}

files!(
    "index.html",
    "panel.css",
    "stop.js",
    "panel.js",
    "connection.js",
    "state.js",
    "words.js",
    "dom.js",
    "trace.js",
    "board.js",
    "inputs.js",
    "counters.js",
    "outputs.js",
    "link.js",
    "sound.js",
    "camera.js",
    "i2c.js",
    "remotes.js",
    "joystick.js",
    "world.js",
    "floor.js",
    "machine.js",
    "overview.js",
    "distance.js",
    "host.js",
    "control_lock.js",
    "icon.svg",
);

/// The file with this name; the page itself without one.
pub(super) fn find(name: &str) -> Option<File> {
    let name = if name.is_empty() { "index.html" } else { name };
    FILES.iter().find(|file| file.name == name).copied()
}

impl File {
    pub(super) fn content_type(&self) -> &'static str {
        match self.name.rsplit('.').next() {
            Some("html") => "text/html; charset=utf-8",
            Some("css") => "text/css; charset=utf-8",
            Some("js") => "text/javascript; charset=utf-8",
            Some("svg") => "image/svg+xml",
            _ => "text/plain; charset=utf-8",
        }
    }
}

#[cfg(test)]
mod tests {
    use ft_transfer_area::transfer_area::InputMode;

    use super::*;

    #[test]
    fn the_page_has_words_for_each_input_mode_in_both_languages() {
        let words = find("words.js").unwrap().text;
        for mode in InputMode::ALL {
            for digital in [0, 1] {
                let key = format!("\"{}/{digital}\": ", mode.name());
                assert_eq!(words.matches(&key).count(), 2, "{key}");
            }
        }
    }
}
