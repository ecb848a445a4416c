//! The text format of Siconos for contact problems.

use crate::contact_problem::{apart, contacts, dense, local, plate, random};
use nalgebra::DMatrix;
use tumble::problem::{ContactProblem, Form, Law, RowLaw, SolveOptions, SparseMatrix, dat};

#[test]
fn text_keeps_every_bit_of_a_problem() {
    let random = random(3, 3, 5);
    let global = random.problem();
    for problem in [&global, &global.to_local().unwrap(), &plate()] {
        let text = dat::write(problem).unwrap();
        let again = dat::read(&text).unwrap();
        assert_eq!(again.laws(), problem.laws());
        match (problem.form(), again.form()) {
            (Form::Local { response, free }, Form::Local { response: r, free: f }) => {
                assert!(response == r && free == f);
            }
            (Form::Global(a), Form::Global(b)) => {
                assert!(a.mass == b.mass && a.directions == b.directions);
                assert!(a.momentum == b.momentum && a.offset == b.offset);
            }
            _ => panic!("another form"),
        }
        // A text that ends early or has a wrong word is refused.
        let words: Vec<&str> = text.split_whitespace().collect();
        for k in (0..words.len()).step_by(7) {
            assert!(dat::read(&words[..k].join(" ")).is_err(), "{k}");
            let mut wrong = words.clone();
            wrong[k] = "nothing";
            let _ = dat::read(&wrong.join(" "));
            wrong[k] = "99999999999";
            let _ = dat::read(&wrong.join(" "));
        }
        assert!(dat::read(&format!("{text} 1 2 3")).is_err());
    }
    let rows = vec![Law::rows_of(vec![RowLaw::Locked]).unwrap()];
    let refused = dat::write(&local(&DMatrix::identity(1, 1), &[0.0], rows)).unwrap_err();
    assert!(refused.to_string().contains("group 0 is not such a contact"), "{refused}");
    let plane = [contacts(&[0.5]), Law::contacts(2, &[0.5]).unwrap()].concat();
    let refused = dat::write(&local(&DMatrix::identity(5, 5), &[0.0; 5], plane)).unwrap_err();
    assert!(refused.to_string().contains("group 1"), "{refused}");
}

/// Checks problems without contacts. They are valid and have nothing to solve.
#[test]
fn the_empty_problem_is_written_and_read() {
    let none = SparseMatrix::from_triplets(0, 0, []).unwrap();
    let empty = ContactProblem::local(none, vec![], vec![]).unwrap();
    let (mass, directions) =
        (dense(&DMatrix::identity(3, 3)), SparseMatrix::from_triplets(3, 0, []).unwrap());
    let falling = ContactProblem::global(mass, directions, vec![0.0, 0.0, -1.0], vec![], vec![]);
    for (problem, v) in [(empty, vec![]), (falling.unwrap(), vec![0.0, 0.0, -1.0])] {
        let again = dat::read(&dat::write(&problem).unwrap()).unwrap();
        assert_eq!((again.row_count(), again.velocity_count()), (0, v.len()));
        let found = again.solve(&SolveOptions::default()).unwrap();
        assert!(found.is_solved() && found.body_velocities == v, "{found:?}");
    }
}

/// Reads the three storages of Siconos: two masses on the ground, written by hand.
#[test]
fn all_storages_are_read() {
    let dense: String = (0..6)
        .map(|i| (0..6).map(|j| if i == j { "2 " } else { "0 " }).collect::<String>() + "\n")
        .collect();
    let block = "2\n0\n0\n0\n2\n0\n0\n0\n2\n";
    let sparse: String = (0..6).map(|k| format!("    {k} {k} : 2.0\n")).collect();
    let columns: String =
        (0..6).map(|k| format!("    col {k} : locations {k} to {k}\n      {k} : 2\n")).collect();
    let head = "3\n2\n";
    let tail = "-1 1 0 -1 -0.1 0\n0.5 0.5\n1\n";
    let texts = [
        format!("{head}0\n6\n6\n6\t6\n{dense}{tail}"),
        format!("{head}1\n6\n6\n2\n2\n2\n3 6\n3 6\n3\n2\n0 1 2\n0 1\n0\n{block}1\n{block}{tail}"),
        format!(
            "{head}2\n6\n6\n0\nCSparse Version 3.1.1, May 20, 2012.  Copyright (c) somebody\ntriplet: \
             6-by-6, nzmax: 6 nnz: 6\n{sparse}{tail}"
        ),
        format!(
            "{head}2\n6\n6\n1\nCSparse Version 3.1.1\n6-by-6, nzmax: 6 nnz: 6, 1-norm: 2\n{columns}{tail}"
        ),
    ];
    for text in texts {
        let found = dat::read(&text).unwrap().solve(&SolveOptions::default()).unwrap();
        assert!(found.is_solved() && found.parts == 2, "{text}");
        assert!(apart(&found.impulses, &[0.5, -0.25, 0.0, 0.5, 0.05, 0.0]) < 1e-12, "{text}");
    }
    let refused = dat::read("3\n1\n7\n3\n3\n").unwrap_err().to_string();
    assert!(refused.contains("line 3") && refused.contains("storage of M"), "{refused}");
}

/// Checks that inconsistent texts are refused: wrong numbers of entries or columns, wrong sizes,
/// wrong words, and numbers that are not finite.
#[test]
fn texts_with_wrong_counts_are_rejected() {
    let head = "3\n1\n2\n3\n3\n";
    let triplets = "1\nCSparse Version 3.2.0\ntriplet: 3-by-3, nzmax: 3 nnz: 3\n";
    let entries = "0 0 : 1\n1 1 : 1\n2 2 : 1\n";
    let columns = "0\nCSparse Version 3.2.0\n3-by-3, nzmax: 3 nnz: 3, 1-norm: 1\n";
    let each = [0, 1, 2].map(|k| format!("col {k} : locations {k} to {k}\n  {k} : 1\n"));
    let tail = "-1 0.2 0\n0.5\n";
    let (by_entries, by_columns) = (
        format!("{head}{triplets}{entries}{tail}"),
        format!("{head}{columns}{}{tail}", each.concat()),
    );
    for text in [&by_entries, &by_columns] {
        let found = dat::read(text).unwrap().solve(&SolveOptions::default()).unwrap();
        // W is the identity, so the impulses are as accurate as the requested residual.
        assert!(apart(&found.impulses, &[1.0, -0.2, 0.0]) < 1e-9, "{text}");
    }
    // C prints a count with six digits like this.
    assert!(dat::read(&by_entries.replace("nzmax: 3", "nzmax: 1e+06")).is_ok());
    for (text, old, new, words) in [
        (&by_entries, "2 2 : 1\n", "", "line 8: the header has 3 entries, but 2 follow"),
        (&by_entries, "nnz: 3", "nnz: 2", "line 8: the header has 2 entries, but 3 follow"),
        (&by_entries, "3-by-3", "7-by-9", "line 8: found \"7-by-9,\""),
        (&by_columns, "  2 : 1\n", "", "line 13: the header has 1 entries, but 0 follow"),
        (&by_columns, "nnz: 3", "nnz: 4", "line 8: the header has 4 entries, but 3 follow"),
        (&by_columns, "3-by-3", "3-by-4", "line 8: found \"3-by-4,\""),
        (&by_columns, each[1].as_str(), "", "line 11: found \"2\"; expected the next column"),
        (&by_columns, each[2].as_str(), "", "found \"-1\"; expected col"),
        (&by_columns, "col 2", "col 0", "found \"0\"; expected the next column"),
        (&by_entries, "0.5\n", "", "it ends too early; expected a coefficient of friction"),
        (&by_entries, "0.5\n", "0.5 0.5\n0.5", "line 13: found \"0.5\" after the last"),
        (&by_entries, "0.2", "nan", "line 12: found \"nan\"; expected a number of q"),
        (&by_entries, "1 1 : 1", "1 1 : -inf", "line 10: found \"-inf\"; expected an entry"),
        (&by_entries, "0.5\n", "1e999", "line 13: found \"1e999\"; expected a coefficient"),
    ] {
        assert!(text.contains(old), "{old}");
        let changed = text.replacen(old, new, 1);
        let refused = dat::read(&changed).map(|_| ()).unwrap_err().to_string();
        assert!(refused.contains(words), "{old:?} {new:?}: {refused}");
    }
}
