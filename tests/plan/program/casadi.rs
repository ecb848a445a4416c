//! The program of several steps against CasADi at the points of `data/plan.jsonl.gz`.

use super::{Whole, problem};
use crate::casadi::{Asked, Meeting, Point};
use crate::common::reference;
use serde::Deserialize;
use tumble::plan::program::{PlanNlp, Smoothing};

/// The first line.
#[derive(Deserialize)]
struct Head {
    scene: String,
    problem: String,
}

#[derive(Deserialize)]
struct Input {
    /// Of each step.
    contacts: Vec<Vec<Meeting>>,
    delta: f64,
    compliance: f64,
    #[serde(flatten)]
    asked: Asked,
}

/// As a part of the largest number of a kind: sums of some hundred products, rounded in another order.
const ROUNDING: f64 = 1e-12;

#[test]
fn values_and_derivatives_are_those_of_casadi() {
    let text = reference("plan.jsonl.gz");
    let mut lines = text.lines();
    let head: Head = serde_json::from_str(lines.next().unwrap()).unwrap();
    let problem = problem(&head.scene, &head.problem).problem;
    let replay = problem.replay(&problem.zero()).unwrap();
    let points: Vec<Point<Input>> = lines.map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(points.len(), 12);
    for Point { name, input, output } in &points {
        let bodies = problem.scene().world.bodies();
        let made = |(step, meetings): (usize, &Vec<Meeting>)| {
            let poses: Vec<_> = replay.states[step].iter().map(|state| state.pose()).collect();
            let contact = |(index, of): (usize, &Meeting)| of.contact(index, bodies, &poses);
            meetings.iter().enumerate().map(contact).collect::<Vec<_>>()
        };
        let contacts: Vec<_> = input.contacts.iter().enumerate().map(made).collect();
        let smoothing = Smoothing { delta: input.delta, compliance: input.compliance };
        let nlp = PlanNlp::smoothed_with(&problem, &replay, &contacts, smoothing).unwrap();
        let asked = &input.asked;
        assert_eq!((nlp.variables(), nlp.rows()), (asked.x.len(), asked.multipliers.len()));
        let objective = nlp.objective(&asked.x);
        output.compare(name, &Whole(nlp), asked, objective, ROUNDING);
    }
}
