//! Live runs: what the server refuses, and the record of what was touched.
#![cfg(unix)]

use crate::ROOT;
use crate::support::{PROGRAM, Table, run, simulate};
use serde_json::{Value, json};
use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::TcpStream;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::Duration;
use tempfile::TempDir;
use tungstenite::client::IntoClientRequest as _;
use tungstenite::{Message, WebSocket};

/// Numbers of a frame before those of the bodies, and numbers of a body.
const HEAD: usize = 20;
const NUMBERS_OF_BODY: usize = 7;
/// Time for an answer.
const PATIENCE: Duration = Duration::from_secs(120);

/// A live run of the tower of ten boxes.
struct Live {
    child: Child,
    directory: TempDir,
    /// Address and port.
    host: String,
    token: String,
}

impl Live {
    fn start() -> Self {
        Self::start_of(&[&format!("{ROOT}/scenarios/stack.toml")])
    }

    /// Live run of a scene of these arguments.
    fn start_of(scene: &[&str]) -> Self {
        let directory = tempfile::tempdir().unwrap();
        let mut child = Command::new(PROGRAM)
            .arg("run")
            .args(scene)
            .args(["--live", "--out"])
            .arg(directory.path().join("out"))
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.as_mut().unwrap()).read_line(&mut line).unwrap();
        let address = line.trim().strip_prefix("http://").unwrap();
        let (host, token) = address.trim_end_matches('/').split_once('/').unwrap();
        let (host, token) = (host.to_owned(), token.to_owned());
        Self { child, directory, host, token }
    }

    /// Answer to the bytes of an HTTP request.
    fn answered(&self, request: &[u8]) -> String {
        let mut stream = TcpStream::connect(&self.host).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        stream.write_all(request).unwrap();
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).unwrap();
        String::from_utf8(answer).unwrap()
    }

    /// Status of the answer to a request with these fields beside the host.
    fn status(&self, line: &str, fields: &str) -> u32 {
        let host = &self.host;
        let answer =
            self.answered(format!("{line} HTTP/1.1\r\nHost: {host}\r\n{fields}\r\n").as_bytes());
        answer.split(' ').nth(1).unwrap().parse().unwrap()
    }

    fn socket(&self) -> Socket {
        let (host, token) = (&self.host, &self.token);
        let stream = TcpStream::connect(host).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        let mut request = format!("ws://{host}/{token}/live").into_client_request().unwrap();
        request.headers_mut().insert("origin", format!("http://{host}").parse().unwrap());
        let (socket, _) = tungstenite::client(request, stream).unwrap();
        Socket { socket }
    }

    /// Ends the run by Ctrl-C and waits for its files.
    fn end(&mut self) -> i32 {
        let killed =
            Command::new("kill").args(["-INT", &self.child.id().to_string()]).status().unwrap();
        assert!(killed.success());
        self.child.wait().unwrap().code().unwrap()
    }

    fn states(&self) -> PathBuf {
        self.directory.path().join("out/states.csv")
    }
}

impl Drop for Live {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

struct Socket {
    socket: WebSocket<TcpStream>,
}

impl Socket {
    fn asked(&mut self, request: &Value) -> (Value, Vec<f64>) {
        self.answer(&request.to_string())
    }

    /// Answer to a text: its fields and its numbers.
    fn answer(&mut self, request: &str) -> (Value, Vec<f64>) {
        self.socket.send(Message::text(request)).unwrap();
        let Message::Binary(bytes) = self.socket.read().unwrap() else { panic!("a text") };
        let length = u32::from_le_bytes(bytes[..4].try_into().unwrap()) as usize;
        let text = serde_json::from_slice(&bytes[4..4 + length]).unwrap();
        let numbers = bytes[(4 + length).next_multiple_of(8)..].chunks(8);
        let number = |bytes: &[u8]| f64::from_le_bytes(bytes.try_into().unwrap());
        (text, numbers.map(number).collect())
    }

    /// Code with which the server closes the socket.
    fn closed(mut self) -> u16 {
        match self.socket.read() {
            Ok(Message::Close(Some(frame))) => frame.code.into(),
            other => panic!("{other:?}"),
        }
    }
}

/// Positions and attitudes of all bodies in the last rows of states.csv.
fn last_states(table: &Table, bodies: usize) -> Vec<f64> {
    let columns = ["x_m", "y_m", "z_m", "qw", "qx", "qy", "qz"].map(|name| table.numbers(name));
    let rows = columns[0].len();
    let row = |row: usize| columns.iter().map(move |column| column[row]);
    (rows - bodies..rows).flat_map(row).collect()
}

#[test]
fn a_pull_is_recorded_and_the_run_is_verified() {
    let mut live = Live::start();
    let mut socket = live.socket();
    let (scene, _) = socket.asked(&json!({ "do": "look" }));
    assert_eq!(scene["film"]["bodies"].as_array().unwrap().len(), 10);
    socket.asked(&json!({ "do": "step", "count": 25, "contacts": false }));
    let aim = json!({ "do": "grab", "origin": [5.0, 0.1, 0.95], "direction": [-1.0, 0.0, 0.0] });
    assert_eq!(socket.asked(&aim).0["body"], 4);
    for k in 0..60 {
        let (x, z) = (0.2 + 0.02 * f64::from(k), 0.95 + 0.002 * f64::from(k));
        socket.asked(&json!({ "do": "pull", "target": [x, 0.1, z] }));
        socket.asked(&json!({ "do": "step", "count": 1, "contacts": false }));
    }
    socket.asked(&json!({ "do": "release" }));
    // Another window continues where the first one was, and the first one sees it.
    let mut other = live.socket();
    let (_, shown) = other.asked(&json!({ "do": "step", "count": 115, "contacts": true }));
    assert_eq!(shown[0], 200.0);
    let (_, seen) = socket.asked(&json!({ "do": "step", "count": 0, "contacts": true }));
    assert_eq!(seen[HEAD..], shown[HEAD..]);
    assert_eq!(live.end(), 0);

    let table = Table::parse(&std::fs::read_to_string(live.states()).unwrap());
    let bodies = &shown[HEAD..HEAD + 10 * NUMBERS_OF_BODY];
    assert_eq!(last_states(&table, 10), bodies, "each number has the digits of its bits");
    let verified = run(&["verify", live.states().to_str().unwrap()]);
    assert_eq!(verified.code, Some(0), "{verified:?}");
    let run_json = live.directory.path().join("out/run.json");
    let run_json: Value =
        serde_json::from_str(&std::fs::read_to_string(run_json).unwrap()).unwrap();
    assert!(!run_json["model"]["bodies"][4]["load"].is_null(), "the pull is a load");
}

#[test]
fn change_of_a_live_run_starts_a_new_part() {
    let mut live = Live::start();
    let mut socket = live.socket();
    let step = |count: u32| json!({ "do": "step", "count": count, "contacts": false });
    let (_, before) = socket.asked(&step(20));
    let change = json!({ "do": "change", "change": { "friction": 0.2 } });
    assert_eq!(socket.asked(&change).0["parts"], 1);
    socket.asked(&step(5));
    assert_eq!(live.end(), 0);
    let out = live.directory.path().join("out");
    let part = out.join("part-1.toml");
    let again = simulate(&["run", part.to_str().unwrap()]);
    assert_eq!(again.end.code, Some(0), "{:?}", again.end);
    let table = std::fs::read_to_string(again.path("states.csv")).unwrap();
    assert_eq!(last_states(&Table::parse(&table), 10), before[HEAD..]);
    let run_json = std::fs::read_to_string(out.join("run.json")).unwrap();
    let run_json: Value = serde_json::from_str(&run_json).unwrap();
    assert!(run_json["files"].as_array().unwrap().contains(&json!("part-1.toml")));
    assert_eq!(run(&["verify", live.states().to_str().unwrap()]).code, Some(0));
    // A file that no run wrote is refused before the page is served.
    std::fs::write(out.join("part-7.toml"), "mine").unwrap();
    let scene = format!("{ROOT}/scenarios/stack.toml");
    run(&["run", &scene, "--live", "--out", out.to_str().unwrap()])
        .assert_refused(2, &["part-7.toml"]);
    // The next run in the folder removes the part.
    run(&["run", &scene, "--steps", "3", "--out", out.to_str().unwrap()]);
    assert!(!part.exists() && out.join("part-7.toml").exists());
}

#[test]
fn a_live_run_takes_over_at_a_row_of_an_earlier_run() {
    let before = simulate(&["run", &format!("{ROOT}/scenarios/drop.toml"), "--steps", "400"]);
    assert_eq!(before.end.code, Some(0), "{:?}", before.end);
    let table = before.path("states.csv");
    let table = table.to_str().unwrap();
    let states = Table::parse(&std::fs::read_to_string(table).unwrap());
    let row = |k: usize| -> Vec<f64> {
        let columns = ["x_m", "y_m", "z_m", "qw", "qx", "qy", "qz"];
        columns.map(|name| states.numbers(name)[k]).to_vec()
    };
    let mut live = Live::start_of(&["--from", table, "--at", "240"]);
    let mut socket = live.socket();
    let (_, start) = socket.asked(&json!({ "do": "step", "count": 0, "contacts": false }));
    assert_eq!((start[0], &start[HEAD..]), (240.0, &row(240)[..]));
    let (_, end) = socket.asked(&json!({ "do": "step", "count": 60, "contacts": false }));
    assert_eq!(end[0], 300.0);
    let apart = end[HEAD..].iter().zip(row(300)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    // The solver starts anew, so the last digits differ.
    assert!(apart < 1e-6, "{apart}");
    assert_eq!(live.end(), 0);
    assert_eq!(run(&["verify", live.states().to_str().unwrap()]).code, Some(0));
    let invalid = ["run", "--live", "--from", table, "--at", "400"];
    run(&invalid).assert_refused(2, &["at", "k = 400"]);
}

#[test]
fn strangers_and_invalid_messages_are_rejected_and_the_run_continues() {
    let mut live = Live::start();
    let token = live.token.clone();
    let get = |path: &str| format!("GET /{path}");
    assert_eq!(live.status(&get(&format!("{token}/")), ""), 200);
    for (line, fields, status) in [
        (get(""), "", 403),
        (get(&format!("{}/", "0".repeat(token.len()))), "", 403),
        (get(&token), "", 403),
        (get(&format!("{token}/../etc/passwd")), "", 404),
        (format!("POST /{token}/"), "", 405),
        (get(&format!("{token}/")), "Host: other\r\n", 400),
        (get(&format!("{token}/live")), "", 403),
        (get(&format!("{token}/live")), "Origin: http://localhost\r\n", 403),
        (get(&format!("{token}/live")), "Origin: null\r\n", 403),
        (get(&format!("{token}/live")), &format!("Origin: http://{}\r\n", live.host), 426),
        (get(&format!("{token}/")), &format!("A: {}\r\n", "a".repeat(20_000)), 431),
        (get(&format!("{token}/")), &"A: a\r\n".repeat(100), 431),
    ] {
        assert_eq!(live.status(&line, fields), status, "{line} {fields}");
    }
    assert!(live.answered(b"\x16\x03\x01\x02\x00 TLS").starts_with("HTTP/1.1 400 "));
    let foreign = format!("GET /{token}/ HTTP/1.1\r\nHost: tumble.example\r\n\r\n");
    assert!(live.answered(foreign.as_bytes()).starts_with("HTTP/1.1 421 "));

    let mut socket = live.socket();
    for invalid in ["", "{", "[]", r#"{"do":"dance"}"#, r#"{"do":"step","count":-1}"#] {
        assert!(socket.answer(invalid).0["error"].is_string(), "{invalid}");
    }
    socket.asked(&json!({ "do": "step", "count": 7, "contacts": false }));
    // A frame announces 16 MB.
    let huge = [0x81, 0xff, 0, 0, 0, 0, 1, 0, 0, 0, 1, 2, 3, 4, 5];
    let bad = [0xff, 0x80, 1, 2, 3, 4];
    let broken = [0x81, 0x81, 0, 0, 0, 0, 0xff];
    let binary = [0x82, 0x81, 0, 0, 0, 0, 1];
    for (frame, code) in
        [(&huge[..], 1009), (&bad[..], 1002), (&broken[..], 1007), (&binary[..], 1003)]
    {
        let mut socket = live.socket();
        socket.socket.get_mut().write_all(frame).unwrap();
        assert_eq!(socket.closed(), code);
    }
    let (_, shown) = live.socket().asked(&json!({ "do": "step", "count": 1, "contacts": false }));
    assert_eq!(shown[0], 8.0);
    assert_eq!(live.end(), 0);
}

/// Clients that send a byte now and then do not hold the run: Ctrl-C cuts them off, long before the
/// largest head of a request.
#[test]
fn clients_that_send_byte_by_byte_do_not_hold_the_run() {
    let mut live = Live::start();
    let drips = |host: String| {
        std::thread::spawn(move || {
            let mut stream = TcpStream::connect(host).unwrap();
            let pause = Duration::from_millis(5);
            (0..10_000)
                .take_while(|_| {
                    std::thread::sleep(pause);
                    stream.write_all(b"a").is_ok()
                })
                .count()
        })
    };
    let clients: Vec<_> = (0..40).map(|_| drips(live.host.clone())).collect();
    assert_eq!(live.end(), 0);
    for client in clients {
        assert!(client.join().unwrap() < 10_000);
    }
}

/// A request for many steps is refused, or holds neither another window nor Ctrl-C, and ends with its
/// page. Nobody reads its answer here.
#[test]
fn many_steps_of_one_window_leave_the_others_free() {
    let step = |count: u32| json!({ "do": "step", "count": count, "contacts": false });
    let mut live = Live::start_of(&[&format!("{ROOT}/playground/measure/thousand.toml")]);
    let mut other = live.socket();
    let (refused, _) = other.asked(&step(4_000_000_000));
    assert_eq!(refused["error"], "step: count is 4000000000; allowed: 0 to 100000");
    let mut busy = live.socket();
    let many = || Message::text(step(100_000).to_string());
    busy.socket.send(many()).unwrap();
    std::thread::sleep(Duration::from_millis(200));
    let begin = std::time::Instant::now();
    let (_, first) = other.asked(&step(0));
    drop(busy);
    std::thread::sleep(Duration::from_secs(2));
    let (_, second) = other.asked(&step(0));
    std::thread::sleep(Duration::from_secs(2));
    let (_, third) = other.asked(&step(0));
    assert_eq!(second[0], third[0], "the steps ended with their page");
    assert!(first[0] < 10_000.0 && begin.elapsed() < PATIENCE / 2, "{first:?}");
    // A new scene is not stepped by a request for the one before.
    let mut busy = live.socket();
    busy.socket.send(many()).unwrap();
    std::thread::sleep(Duration::from_millis(200));
    other.asked(&json!({ "do": "restart" }));
    std::thread::sleep(Duration::from_secs(1));
    assert_eq!(other.asked(&step(0)).1[0], 0.0);
    busy.socket.send(many()).unwrap();
    std::thread::sleep(Duration::from_millis(200));
    let begin = std::time::Instant::now();
    live.end();
    assert!(begin.elapsed() < PATIENCE / 2, "{:?}", begin.elapsed());
}

#[test]
fn pulls_to_where_no_body_may_be_are_refused() {
    let live = Live::start();
    let mut socket = live.socket();
    socket.asked(&json!({ "do": "hold", "body": 4 }));
    for target in [1e300, -1e7] {
        let (refused, _) = socket.asked(&json!({ "do": "pull", "target": [target, 0.0, 0.0] }));
        let why = refused["error"].as_str().unwrap();
        assert!(why.contains("target of the pull (m)") && why.contains("-1e6 to 1e6"), "{why}");
    }
}

#[test]
fn flags_without_effect_on_a_live_run_are_rejected() {
    // Ipopt's program has one body.
    let scene = format!("{ROOT}/scenarios/drop.toml");
    let refused = |flags: &[&str], words: &[&str]| {
        let directory = tempfile::tempdir().unwrap();
        let out = directory.path().join("out");
        let args = ["run", &scene, "--live", "--out", out.to_str().unwrap()];
        run(&[&args, flags].concat()).assert_refused(2, words);
        assert!(!out.exists());
    };
    refused(&["--steps", "3"], &["steps", "--live"]);
    refused(&["--solver", "ipopt"], &["solver", "--live"]);
    refused(&["--live-address", "0.0.0.0:0"], &["0.0.0.0", "all interfaces"]);
    refused(&["--live-address", "192.0.2.1:0"], &["192.0.2.1", "cannot be served"]);
}
