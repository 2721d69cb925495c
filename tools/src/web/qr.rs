//! An address as a picture that a phone's camera reads.

use anyhow::Context;
use qrcode::render::unicode::Dense1x2;
use qrcode::{EcLevel, QrCode};

/// Black on white, whatever the colours of the terminal are: not every camera reads it the other way round.
const COLOURS: &str = "\x1b[30;107m";
const NO_COLOURS: &str = "\x1b[0m";

/// The code of an address, in lines for a terminal.
pub(crate) fn code(url: &str) -> anyhow::Result<String> {
    let code = made(url, EcLevel::L)?;
    let picture = code.render::<Dense1x2>().build();
    let lines: Vec<_> =
        picture.lines().map(|line| format!("{COLOURS}{line}{NO_COLOURS}")).collect();
    Ok(lines.join("\n"))
}

/// The same as a picture for a page.
pub(crate) fn svg(url: &str) -> anyhow::Result<String> {
    /// How many light modules are around the code.
    const QUIET: usize = 4;
    let code = made(url, EcLevel::M)?;
    let dark = code.to_colors().into_iter().enumerate();
    let dark = dark.filter(|(_, colour)| *colour == qrcode::Color::Dark);
    let place = |(index, _)| (index % code.width() + QUIET, index / code.width() + QUIET);
    let path: String = dark.map(place).map(|(x, y)| format!("M{x} {y}h1v1h-1z")).collect();
    let side = code.width() + 2 * QUIET;
    Ok(format!(
        "<svg viewBox=\"0 0 {side} {side}\" shape-rendering=\"crispEdges\"><path fill=\"#fff\" d=\"M0 0h{side}v{side}H0z\"/>\
         <path d=\"{path}\"/></svg>"
    ))
}

fn made(url: &str, level: EcLevel) -> anyhow::Result<QrCode> {
    QrCode::with_error_correction_level(url, level).with_context(|| format!("{url} has no QR code"))
}

#[cfg(test)]
mod tests {
    use super::*;

    const URL: &str = "http://192.168.178.120:43210/?token=0123456789abcdef0123456789abcdef";

    /// The dark modules of the printed lines.
    fn modules(lines: &str) -> Vec<Vec<bool>> {
        let plain = lines.replace(COLOURS, "").replace(NO_COLOURS, "");
        let half =
            |line: &str, parts: [char; 2]| line.chars().map(|one| parts.contains(&one)).collect();
        plain.lines().flat_map(|line| [half(line, ['▀', '█']), half(line, ['▄', '█'])]).collect()
    }

    #[test]
    fn the_code_has_its_quiet_zone_and_fits_a_terminal() {
        let printed = code(URL).unwrap();
        let picture = modules(&printed);
        assert!(picture.len() <= 48 && picture[0].len() <= 80, "{printed}");
        // Four modules on each side are light, and then come three corners.
        assert!(picture[..4].iter().flatten().all(|dark| !dark));
        assert!(picture.iter().all(|row| !row[..4].contains(&true)));
        let wanted = QrCode::with_error_correction_level(URL, EcLevel::L).unwrap();
        let colours = wanted.to_colors();
        for (y, row) in colours.chunks(wanted.width()).enumerate() {
            let dark: Vec<_> = row.iter().map(|one| *one == qrcode::Color::Dark).collect();
            assert_eq!(picture[y + 4][4..4 + dark.len()], dark[..], "row {y}");
        }
    }
}
