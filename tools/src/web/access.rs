//! Who may use the server: the page that it serves itself, with the token that the program prints.

use std::net::IpAddr;

use axum::http::header::{HOST, ORIGIN};
use axum::http::{HeaderMap, StatusCode};
use serde::Deserialize;

/// 128 random bits in hexadecimal digits.
const TOKEN_BYTES: usize = 16;

/// A sentence with a status, for requests that get nothing else.
pub(crate) type Refusal = (StatusCode, &'static str);

pub(crate) const WRONG_HOST: Refusal = (
    StatusCode::FORBIDDEN,
    "this is not the address of the page; use the one that the program prints\n",
);
const WRONG_TOKEN: Refusal = (
    StatusCode::FORBIDDEN,
    "the token is missing or wrong; use the address that the program prints, with its token\n",
);
const WRONG_ORIGIN: Refusal =
    (StatusCode::FORBIDDEN, "a page of another origin may not use this one\n");
pub(crate) const TOO_MANY: Refusal =
    (StatusCode::SERVICE_UNAVAILABLE, "too many pages are open; close some of them\n");

/// What a request has in its address.
#[derive(Deserialize)]
pub(crate) struct Asked {
    #[serde(default)]
    token: String,
}

/// A secret that lets in who has it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Token(String);

impl Token {
    pub(crate) fn random() -> anyhow::Result<Self> {
        let mut bytes = [0; TOKEN_BYTES];
        getrandom::fill(&mut bytes)
            .map_err(|error| anyhow::anyhow!("there is no random number for a token ({error})"))?;
        Ok(Self(bytes.iter().map(|byte| format!("{byte:02x}")).collect()))
    }

    /// A token that was made before; `None` for another text, which somebody might guess.
    pub(crate) fn known(text: &str) -> Option<Self> {
        let is_one = text.len() == 2 * TOKEN_BYTES
            && text.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f'));
        is_one.then(|| Self(text.to_owned()))
    }

    pub(crate) fn text(&self) -> &str {
        &self.0
    }
}

/// What a request has to bring.
#[derive(Debug)]
pub(crate) struct Access {
    token: Token,
    port: u16,
    /// Whether other computers may use the server.
    beyond: bool,
}

impl Access {
    /// A new token, for a server at this address and port.
    pub(crate) fn new(address: IpAddr, port: u16) -> anyhow::Result<Self> {
        Ok(Self::with(address, port, Token::random()?))
    }

    /// The same with this token.
    pub(crate) fn with(address: IpAddr, port: u16, token: Token) -> Self {
        Self { token, port, beyond: !address.is_loopback() }
    }

    pub(crate) fn token(&self) -> &str {
        self.token.text()
    }

    /// An error unless the request comes from this server's page, or from no page at all, and has the token.
    pub(crate) fn admit(&self, headers: &HeaderMap, asked: &Asked) -> Result<(), Refusal> {
        if !self.is_own_page(headers) {
            return Err(WRONG_ORIGIN);
        }
        if !self.knows(&asked.token) {
            return Err(WRONG_TOKEN);
        }
        Ok(())
    }

    /// Whether the token is the right one. Takes as long for a nearly right one as for any other.
    fn knows(&self, token: &str) -> bool {
        let (given, right) = (token.as_bytes(), self.token.text().as_bytes());
        let differences = given.iter().zip(right).fold(0, |all, (one, other)| all | (one ^ other));
        given.len() == right.len() && differences == 0
    }

    /// The address that the browser used, if it is one of this server.
    ///
    /// A page from elsewhere can give the address of this server to a name of its own, so names are
    /// refused. A browser sends a number only if it went to this number.
    pub(crate) fn host<'a>(&self, headers: &'a HeaderMap) -> Option<&'a str> {
        let host = headers.get(HOST)?.to_str().ok()?;
        let (name, port) = match host.rsplit_once(':') {
            Some((name, port)) if !port.ends_with(']') => (name, port.parse().ok()?),
            // Browsers leave out the usual port.
            _ => (host, 80),
        };
        if port != self.port {
            return None;
        }
        let number = name.trim_start_matches('[').trim_end_matches(']').parse::<IpAddr>();
        let is_here = match number {
            Ok(number) => self.beyond || number.is_loopback(),
            Err(_) => name == "localhost",
        };
        is_here.then_some(host)
    }

    /// Whether the request comes from this server's page, or from no page at all.
    fn is_own_page(&self, headers: &HeaderMap) -> bool {
        let Some(origin) = headers.get(ORIGIN) else { return true };
        let own = self.host(headers).map(|host| format!("http://{host}"));
        own.is_some_and(|own| origin.as_bytes() == own.as_bytes())
    }
}

#[cfg(test)]
mod tests {
    use axum::http::HeaderValue;

    use super::*;

    fn headers(host: &'static str, origin: Option<&'static str>) -> HeaderMap {
        let mut headers = HeaderMap::new();
        headers.insert(HOST, HeaderValue::from_static(host));
        if let Some(origin) = origin {
            headers.insert(ORIGIN, HeaderValue::from_static(origin));
        }
        headers
    }

    #[test]
    fn only_numbers_of_this_computer_and_localhost_are_this_server() {
        let here = Access::new([127, 0, 0, 1].into(), 8000).unwrap();
        for host in ["127.0.0.1:8000", "localhost:8000", "[::1]:8000"] {
            assert_eq!(here.host(&headers(host, None)), Some(host));
        }
        for host in
            ["evil.example:8000", "127.0.0.1", "127.0.0.1:8001", "192.168.1.5:8000", ":8000"]
        {
            assert_eq!(here.host(&headers(host, None)), None, "{host}");
        }
        assert_eq!(here.host(&HeaderMap::new()), None);
        let usual = Access::new([127, 0, 0, 1].into(), 80).unwrap();
        for host in ["127.0.0.1", "localhost", "[::1]", "127.0.0.1:80"] {
            assert_eq!(usual.host(&headers(host, None)), Some(host));
        }
        assert_eq!(usual.host(&headers("evil.example", None)), None);
        let beyond = Access::new([0, 0, 0, 0].into(), 8000).unwrap();
        assert!(beyond.host(&headers("192.168.1.5:8000", None)).is_some());
        assert!(beyond.host(&headers("evil.example:8000", None)).is_none());
    }

    #[test]
    fn a_page_of_another_origin_is_not_ours() {
        let access = Access::new([127, 0, 0, 1].into(), 8000).unwrap();
        let host = "127.0.0.1:8000";
        for (origin, own) in [
            (None, true),
            (Some("http://127.0.0.1:8000"), true),
            (Some("http://localhost:8000"), false),
            (Some("https://127.0.0.1:8000"), false),
            (Some("http://127.0.0.1:8001"), false),
            (Some("http://evil.example"), false),
            (Some("null"), false),
        ] {
            assert_eq!(access.is_own_page(&headers(host, origin)), own, "{origin:?}");
        }
    }

    #[test]
    fn only_what_nobody_guesses_is_a_token() {
        let token = Token::random().unwrap();
        assert_eq!(Token::known(token.text()), Some(token));
        for text in ["", "anna", &"a".repeat(31), &"A".repeat(32), &"ä".repeat(16)] {
            assert_eq!(Token::known(text), None, "{text}");
        }
    }

    #[test]
    fn a_token_is_right_only_as_a_whole() {
        let access = Access::new([127, 0, 0, 1].into(), 8000).unwrap();
        let token = access.token().to_owned();
        assert_eq!(token.len(), 2 * TOKEN_BYTES);
        assert!(access.knows(&token));
        assert!(
            !access.knows("") && !access.knows(&token[1..]) && !access.knows(&format!("{token}0"))
        );
        assert!(!Access::new([127, 0, 0, 1].into(), 8000).unwrap().knows(&token));
    }
}
