//! Unit tests of `page.rs`.

use super::*;
use tumble_core::contact::Partner;

#[test]
fn names_in_the_plan_page_are_escaped() {
    let stages = stages(&[StageReport {
        name: "sample",
        iterations: 3,
        runs: 40,
        message: "<i>".to_owned(),
        cost: 2.5,
        meets: false,
        kept: true,
    }]);
    let targets = targets(&[Miss {
        name: "box.x & y".to_owned(),
        by: 0.25,
        tolerance: 0.001,
        unit: "m",
        after: 2,
    }]);
    let key = ContactKey { body: 0, point: 0, partner: Partner::Ground, pair: None };
    let modes = [Mode::Stick, Mode::Slip].map(|mode| vec![ContactMode { key, mode, margin: 0.0 }]);
    let times = [0.0, 0.1, 0.2];
    let charts = [
        ribbon(&times, &["box <b>".to_owned()], &modes),
        cost(vec![9.0, f64::INFINITY, 4.0]),
        control(&times, "force (N)", &[1.0, -1.0]),
        path(&times, "box <b>", &[Vector3::zeros(), Vector3::x(), Vector3::z()]),
    ];
    assert!(charts.iter().all(|chart| chart.matches("<svg viewBox=\"0 0 440").count() == 1));
    let page = [stages, targets, charts.concat()].concat();
    for part in ["x &amp; y", "0.250000", "40", "class=\"stick\"", "class=\"slip\""] {
        assert!(page.contains(part), "{part}");
    }
    for wrong in ["NaN", "<b>", "<i>", "<script", "http://", "https://"] {
        assert!(!page.contains(wrong), "{wrong}");
    }
}
