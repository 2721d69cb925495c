//! Who may use the panel.

use ft_transfer_area_simulator::SimulatedTxt;
use serde_json::json;
use tungstenite::http::HeaderValue;

use super::http::{post_stop, request, status};
use super::page::{self, Page};
use super::program::Panel;
use super::LIMIT;

#[test]
fn without_the_token_nobody_reads_or_drives() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let panel = Panel::of(&[&txt]);
    let other = "0".repeat(panel.token.len());
    for token in ["", "x", &panel.token[1..], &other] {
        let refused = Page::connect(&panel.address, page::request(&panel.address, token));
        assert_eq!(refused.err(), Some(403), "{token}");
        assert_eq!(post_stop(&panel, token, ""), 403, "{token}");
        let camera = request(&panel, &format!("GET /camera/0?token={token}"), &panel.address, "");
        assert_eq!(status(&camera), 403, "{token}");
    }
    assert_eq!(status(&request(&panel, "POST /stop", &panel.address, "")), 403);
}

#[test]
fn a_page_of_another_origin_neither_reads_nor_drives() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let panel = Panel::of(&[&txt]);
    let mut drives = panel.driver();
    drives.done(json!({"do": "motor", "motor": 0, "duty": 512}));
    let own = format!("http://{}", panel.address);
    for (origin, allowed) in [
        ("http://evil.example", false),
        ("null", false),
        ("http://127.0.0.1:1", false),
        (own.as_str(), true),
    ] {
        let mut request = page::request(&panel.address, &panel.token);
        request.headers_mut().insert("Origin", HeaderValue::from_str(origin).unwrap());
        let page = Page::connect(&panel.address, request);
        assert_eq!(page.err(), (!allowed).then_some(403), "{origin}");
        if !allowed {
            let origin = format!("Origin: {origin}\r\n");
            assert_eq!(post_stop(&panel, &panel.token, &origin), 403, "{origin}");
        }
    }
    assert!(txt.wait_until(|machine| machine.controllers[0].outputs.duty[0] == 512, LIMIT));
    assert_eq!(post_stop(&panel, &panel.token, &format!("Origin: {own}\r\n")), 204);
    assert!(txt.wait_until(|machine| machine.controllers[0].outputs.duty[0] == 0, LIMIT));
}

#[test]
fn a_name_that_leads_here_is_refused() {
    let panel = Panel::start(&[]);
    let port = panel.address.rsplit(':').next().unwrap().to_owned();
    for host in
        [format!("evil.example:{port}"), "127.0.0.1".into(), "127.0.0.1:1".into(), String::new()]
    {
        let line = format!("GET /?token={}", panel.token);
        assert_eq!(status(&request(&panel, &line, &host, "")), 403, "{host:?}");
        let line = format!("POST /stop?token={}", panel.token);
        assert_eq!(status(&request(&panel, &line, &host, "")), 403, "{host:?}");
        let mut upgrade = page::request(&panel.address, &panel.token);
        upgrade.headers_mut().insert("Host", HeaderValue::from_str(&host).unwrap());
        assert_eq!(Page::connect(&panel.address, upgrade).err(), Some(403), "{host:?}");
    }
    let here = format!("localhost:{port}");
    assert_eq!(status(&request(&panel, "GET /", &here, "")), 200);
}

#[test]
fn the_page_may_use_nothing_from_elsewhere() {
    let panel = Panel::start(&[]);
    let page = request(&panel, "GET /", &panel.address, "").to_lowercase();
    assert_eq!(status(&page), 200);
    for line in [
        "content-type: text/html; charset=utf-8\r\n",
        "cache-control: no-store\r\n",
        "content-security-policy: default-src 'none'; script-src 'sha256-",
        "; style-src 'sha256-",
        "; img-src 'self'; connect-src 'self' ws://127.0.0.1:",
        "x-content-type-options: nosniff\r\n",
        "referrer-policy: no-referrer\r\n",
        "frame-ancestors 'none'",
    ] {
        assert!(page.contains(line), "{line} is missing in {page}");
    }
    assert!(!page.contains("unsafe"), "{page}");
    let icon = request(&panel, "GET /icon.svg", &panel.address, "");
    assert_eq!(status(&icon), 200);
    assert!(icon.contains("content-type: image/svg+xml"), "{icon}");
    for line in ["GET /../Cargo.toml", "GET /%2e%2e%2fCargo.toml", "GET /icon.svg/x"] {
        assert_eq!(status(&request(&panel, line, &panel.address, "")), 404, "{line}");
    }
    assert_eq!(status(&request(&panel, "DELETE /", &panel.address, "")), 405);
}
