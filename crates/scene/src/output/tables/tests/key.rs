//! Unit tests of `key.rs`.

use super::*;

#[test]
fn keys_read_back_as_they_were_written() {
    let pair = |feature| Some(PairFeatures { pieces: (1, 20), feature, plane: 2 });
    let features = [
        Feature::Vertex(PieceSide::A, 3),
        Feature::Vertex(PieceSide::B, 999),
        Feature::Edges(4, 17),
        Feature::Vertices(0, 1),
        Feature::Round(CorePart::Vertex(3), CorePart::Edge(11)),
        Feature::Round(CorePart::Edge(0), CorePart::Vertex(12)),
        Feature::Round(CorePart::Lateral, CorePart::End(1)),
        Feature::Round(CorePart::Edge(5), CorePart::Lateral),
        Feature::Ellipsoid(PieceSide::A, 0),
        Feature::Ellipsoid(PieceSide::B, 1),
    ];
    let keys = features.map(|feature| KeyText { point: 12, pair: pair(feature) });
    for key in keys.into_iter().chain([KeyText { point: 7, pair: None }]) {
        assert_eq!(KeyText::parse(&key.to_string()), Some(key));
    }
    for invalid in [
        "",
        "a",
        "1.2",
        "1.2.3.C4.0",
        "1.2.3.E4.0",
        "1.2.3.A4.0.0",
        "-1",
        "1.2.3.A.0",
        "1.2.3.Rv1.0",
        "1.2.3.Rv1xf2.0",
    ] {
        assert_eq!(KeyText::parse(invalid), None, "{invalid}");
    }
}
