//! Hulls, pieces, meshes and their masses: closed forms, Euler's formula, and properties of random
//! convex bodies.

use nalgebra::{Matrix3, Rotation3, Vector3};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use std::f64::consts::PI;
use tumble_core::geometry::mesh::{Mesh, parse_obj, parse_stl};
use tumble_core::geometry::{Hull, MassProperties, Piece};
use tumble_core::mechanics::body::solid_box_inertia;

type V = Vector3<f64>;

fn v(x: f64, y: f64, z: f64) -> V {
    V::new(x, y, z)
}

/// Checks that a hull is closed and convex and contains all points. Its face loops are
/// counter-clockwise about their normals, and Euler's V − E + F = 2 holds.
fn check_hull(hull: &Hull, points: &[V]) {
    let size = points.iter().map(|p| p.amax()).fold(0.0, f64::max);
    let (vertices, faces, edges) = (hull.vertices(), hull.faces(), hull.edges());
    assert_eq!(vertices.len() + faces.len(), edges.len() + 2, "Euler");
    for (index, face) in faces.iter().enumerate() {
        assert!((face.normal.norm() - 1.0).abs() < 1e-12);
        for point in points {
            let height = face.normal.dot(point) - face.offset;
            assert!(height < 2e-9 * size, "a point is {height:e} m outside");
        }
        let polygon: Vec<&V> = hull.polygon(index).collect();
        for (at, corner) in polygon.iter().enumerate() {
            let height = face.normal.dot(corner) - face.offset;
            assert!(height.abs() < 2e-9 * size, "a corner is {height:e} m off its face");
            let next = polygon[(at + 1) % polygon.len()];
            let after = polygon[(at + 2) % polygon.len()];
            let turn = (next - *corner).cross(&(after - next)).dot(&face.normal);
            assert!(turn > 0.0, "a loop turns back");
        }
        for (at, corner) in hull.face_loop(index).iter().enumerate() {
            let next = hull.face_loop(index)[(at + 1) % polygon.len()].vertex;
            let edge = hull.edges()[corner.edge as usize];
            let [left, right] = edge.faces.unwrap();
            let forward = edge.vertices == [corner.vertex, next];
            assert!(forward || edge.vertices == [next, corner.vertex]);
            assert_eq!(index as u32, if forward { left } else { right });
        }
    }
    for edge in edges {
        let [from, to] = edge.vertices.map(|vertex| vertices[vertex as usize]);
        let [left, right] = edge.faces.unwrap().map(|face| faces[face as usize].normal);
        assert!(left.cross(&right).dot(&(to - from)) > 0.0, "an edge runs backwards");
    }
    // Vertices keep the order of the points.
    let mut rest = points.iter();
    assert!(vertices.iter().all(|vertex| rest.any(|point| point == vertex)), "order");
}

fn turn(axis_angle: V) -> Matrix3<f64> {
    *Rotation3::new(axis_angle).matrix()
}

#[test]
fn a_box_has_exact_faces_and_its_corners_in_order() {
    let half_sides = v(0.3, 0.2, 0.1);
    let piece = Piece::cuboid(half_sides).unwrap();
    let hull = piece.core();
    let sign = |bit: usize| if bit == 1 { 1.0 } else { -1.0 };
    for (corner, vertex) in hull.vertices().iter().enumerate() {
        let signs = v(sign(corner & 1), sign(corner >> 1 & 1), sign(corner >> 2));
        assert_eq!(*vertex, half_sides.component_mul(&signs));
    }
    check_hull(hull, hull.vertices());
    assert_eq!((hull.vertices().len(), hull.faces().len(), hull.edges().len()), (8, 6, 12));
    for (index, face) in hull.faces().iter().enumerate() {
        let axis = face.normal.iamax();
        assert_eq!(face.normal.abs(), V::ith(axis, 1.0), "an axis, exactly");
        assert_eq!(face.offset, half_sides[axis]);
        assert_eq!(hull.face_loop(index).len(), 4);
    }
}

#[test]
fn points_on_faces_and_edges_and_inside_are_no_vertices() {
    let mut points = Vec::new();
    for index in 0..125 {
        points.push(
            v((index % 5) as f64, (index / 5 % 5) as f64, (index / 25) as f64) - V::repeat(2.0),
        );
    }
    let hull = Hull::from_points(&points).unwrap();
    check_hull(&hull, &points);
    assert_eq!((hull.vertices().len(), hull.faces().len()), (8, 6));
    // The same points rotated: corners deviate from their planes by rounding.
    let rotation = turn(v(0.3, -1.1, 0.7));
    let turned: Vec<V> = points.iter().map(|p| rotation * p).collect();
    let hull = Hull::from_points(&turned).unwrap();
    check_hull(&hull, &turned);
    assert_eq!((hull.vertices().len(), hull.faces().len()), (8, 6));
}

#[test]
fn a_cylinder_of_400_sides_has_402_faces() {
    let ring = |z: f64| {
        (0..400).map(move |k| {
            let angle = f64::from(k) * PI / 200.0;
            v(angle.cos(), angle.sin(), z)
        })
    };
    let points: Vec<V> = ring(-0.5).chain(ring(0.5)).collect();
    for rotation in [Matrix3::identity(), turn(v(1.0, 2.0, -0.4))] {
        let points: Vec<V> = points.iter().map(|p| rotation * p).collect();
        let hull = Hull::from_points(&points).unwrap();
        check_hull(&hull, &points);
        assert_eq!((hull.vertices().len(), hull.faces().len()), (800, 402));
    }
}

#[test]
fn degenerate_points_are_refused_by_name() {
    let refused = |points: &[V]| Hull::from_points(points).unwrap_err().to_string();
    let square = [v(0., 0., 0.), v(1., 0., 0.), v(0., 1., 0.), v(1., 1., 0.)];
    assert!(refused(&square).contains("the hull is flat"));
    assert!(refused(&square.map(|p| v(p.x, p.x, p.x))).contains("flat"));
    assert!(refused(&square[..3]).contains("points of the hull: 3 given"));
    assert!(refused(&[V::zeros(); 8]).contains("largest extent of the hull (m)"));
    assert!(refused(&[v(f64::NAN, 0., 0.), square[1], square[2], square[3]]).contains("(m)"));
    let thin = square.map(|p| v(p.x, p.y, 1e-6 * p.x * p.y));
    assert!(refused(&thin).contains("flat"));
    assert!(Piece::cuboid(v(1.0, 0.0, 1.0)).unwrap_err().to_string().contains("half side"));
    assert!(Piece::sphere(-1.0).unwrap_err().to_string().contains("radius of the sphere (m)"));
    assert!(Piece::capsule(1.0, f64::NAN).is_err() && Piece::capsule(0.0, 1.0).is_err());
    let skew = Matrix3::new(1.0, 0.1, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
    let cube = Piece::cuboid(V::repeat(1.0)).unwrap();
    assert!(cube.moved_by(&skew, &V::zeros()).unwrap_err().to_string().contains("rotation"));
    assert!(cube.moved_by(&-Matrix3::identity(), &V::zeros()).is_err(), "a mirror");
}

fn close(given: &MassProperties, volume: f64, centre: V, inertia: Matrix3<f64>, tolerance: f64) {
    assert!((given.volume / volume - 1.0).abs() < tolerance, "{} {volume}", given.volume);
    assert!((given.centre - centre).amax() < tolerance, "{} {centre}", given.centre);
    let miss = (given.inertia - inertia).amax() / inertia.amax();
    assert!(miss < tolerance, "{miss:e}: {} {inertia}", given.inertia);
}

/// Tolerance: some tens of additions of rounded numbers.
const ROUNDING: f64 = 1e-13;

#[test]
fn masses_of_simple_shapes_have_their_closed_forms() {
    let half_sides = v(0.3, 0.2, 0.1);
    let given = MassProperties::from_piece(&Piece::cuboid(half_sides).unwrap());
    close(&given, 0.048, V::zeros(), solid_box_inertia(0.048, &half_sides), ROUNDING);

    // Corner tetrahedron of the unit cube: V = 1/6, c = 1/4, ∫ x² = 1/60, ∫ x y = 1/120.
    let corners = [V::zeros(), V::x(), V::y(), V::z()];
    let given = MassProperties::from_piece(&Piece::hull(&corners, 0.0).unwrap());
    let second = Matrix3::repeat(1.0 / 120.0 - 1.0 / 96.0)
        + Matrix3::identity() * (1.0 / 60.0 - 1.0 / 120.0);
    let inertia = Matrix3::identity() * second.trace() - second;
    close(&given, 1.0 / 6.0, V::repeat(0.25), inertia, ROUNDING);

    let r: f64 = 0.7;
    let volume = 4.0 / 3.0 * PI * r.powi(3);
    let given = MassProperties::from_piece(&Piece::sphere(r).unwrap());
    close(&given, volume, V::zeros(), Matrix3::identity() * (0.4 * volume * r * r), ROUNDING);

    // Capsule: a cylinder and two half balls, with textbook moments.
    let (h, r) = (0.5, 0.2f64);
    let (cylinder, ball) = (PI * r * r * 2.0 * h, 4.0 / 3.0 * PI * r.powi(3));
    let along = cylinder * r * r / 2.0 + ball * 0.4 * r * r;
    let across =
        cylinder * (r * r / 4.0 + h * h / 3.0) + ball * (0.4 * r * r + h * h + 0.75 * h * r);
    let given = MassProperties::from_piece(&Piece::capsule(h, r).unwrap());
    let inertia = Matrix3::from_diagonal(&v(across, across, along));
    close(&given, cylinder + ball, V::zeros(), inertia, ROUNDING);
}

/// Checks an L of two boxes against sums by hand.
#[test]
fn the_mass_of_an_l_shape_is_the_sum_of_its_boxes() {
    let place =
        |x, y| move |piece: Piece| piece.moved_by(&Matrix3::identity(), &v(x, y, 0.0)).unwrap();
    let foot = place(1.0, 0.5)(Piece::cuboid(v(1.0, 0.5, 0.5)).unwrap());
    let leg = place(0.5, 2.0)(Piece::cuboid(v(0.5, 1.0, 0.5)).unwrap());
    let given = MassProperties::from_pieces([&foot, &leg]).unwrap();
    let centre = v(0.75, 1.25, 0.0);
    let part = |half_sides: V, at: V| {
        let d: V = at - centre;
        let steiner = Matrix3::identity() * d.norm_squared() - d * d.transpose();
        solid_box_inertia(2.0, &half_sides) + steiner * 2.0
    };
    let inertia =
        part(v(1.0, 0.5, 0.5), v(1.0, 0.5, 0.0)) + part(v(0.5, 1.0, 0.5), v(0.5, 2.0, 0.0));
    close(&given, 4.0, centre, inertia, ROUNDING);
    assert!(MassProperties::from_pieces([]).is_err());
}

/// Checks a box rounded by r. It is the union of the box, six slabs, twelve quarter cylinders and
/// eight eighths of a ball. Their textbook moments sum up. By symmetry about the centre, ∫ x² is
/// enough.
#[test]
fn the_mass_of_a_rounded_box_has_its_closed_form() {
    let (a, r) = (v(0.5, 0.3, 0.2), 0.1f64);
    let corners = Piece::cuboid(a).unwrap().core().vertices().to_vec();
    let given = MassProperties::from_piece(&Piece::hull(&corners, r).unwrap());
    // ∫ over [a, a + r] × quarter circle and so on: moments of y = a + s, s ≥ 0.
    let slab = |a: f64| ((a + r).powi(3) - a.powi(3)) * 2.0 / 3.0;
    let inner = |a: f64| 2.0 / 3.0 * a.powi(3);
    let (mut volume, mut second) = (8.0 * a.product(), V::zeros());
    for i in 0..3 {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        let face = 4.0 * a[j] * a[k];
        volume += 2.0 * r * face + PI * r * r * 2.0 * a[i];
        second[i] += inner(a[i]) * face + slab(a[i]) * face;
        second[i] += 2.0 * r * inner(a[i]) * (2.0 * a[j] + 2.0 * a[k]) + PI * r * r * inner(a[i]);
        // Rounded across i: (a + s)² over a quarter disc, four of them, on edges along j and k.
        let quarter =
            a[i] * a[i] * PI * r * r / 4.0 + 2.0 * a[i] * r.powi(3) / 3.0 + PI * r.powi(4) / 16.0;
        second[i] += 4.0 * quarter * (2.0 * a[j] + 2.0 * a[k]);
        // Eighths of a ball: ∫ 1 = π r³/6, ∫ s = π r⁴/16, ∫ s² = π r⁵/30.
        second[i] += 8.0
            * (a[i] * a[i] * PI * r.powi(3) / 6.0
                + 2.0 * a[i] * PI * r.powi(4) / 16.0
                + PI * r.powi(5) / 30.0);
    }
    volume += 4.0 / 3.0 * PI * r.powi(3);
    let second = Matrix3::from_diagonal(&second);
    close(&given, volume, V::zeros(), Matrix3::identity() * second.trace() - second, ROUNDING);
}

fn cloud() -> impl Strategy<Value = Vec<V>> {
    let coordinate = || -1.0..1.0f64;
    prop::collection::vec((coordinate(), coordinate(), coordinate()), 8..60)
        .prop_map(|points| points.into_iter().map(|(x, y, z)| v(x, y, z)).collect())
}

fn placement() -> impl Strategy<Value = (Matrix3<f64>, V)> {
    let part = || -3.0..3.0f64;
    ((part(), part(), part()), (part(), part(), part()))
        .prop_map(|(a, t)| (turn(v(a.0, a.1, a.2)), v(t.0, t.1, t.2)))
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 100,
        rng_seed: RngSeed::Fixed(7),
        ..Default::default()
    })]

    #[test]
    fn hulls_of_random_points_are_hulls(points in cloud(), grid in 0..3u32) {
        // On a coarse grid most points are exactly coplanar with many others.
        let steps = [0.0, 2.0, 3.0][grid as usize];
        let points: Vec<V> = if grid == 0 { points } else {
            points.iter().map(|p| p.map(|x| (x * steps).round())).collect()
        };
        if let Ok(hull) = Hull::from_points(&points) {
            check_hull(&hull, &points);
            let rotation = turn(v(0.5, 0.25, -2.0));
            let turned: Vec<V> = points.iter().map(|p| rotation * p).collect();
            let other = Hull::from_points(&turned).unwrap();
            check_hull(&other, &turned);
            prop_assert_eq!(hull.vertices().len(), other.vertices().len());
            prop_assert_eq!(hull.faces().len(), other.faces().len());
        } else {
            prop_assert!(grid != 0, "random points have a hull");
        }
    }

    /// Checks that the mass of a moved piece is the moved mass, also for rounded pieces. The volume
    /// of a rounded polyhedron is Steiner's: V + A r + r² Σ L θ/2 + 4/3 π r³.
    #[test]
    fn mass_moves_with_its_piece(
        points in cloud(),
        (rotation, shift) in placement(),
        r in 0.0..0.5,
    ) {
        let piece = Piece::hull(&points, r).unwrap();
        let moved = MassProperties::from_piece(&piece.moved_by(&rotation, &shift).unwrap());
        let own = MassProperties::from_piece(&piece);
        let inertia = rotation * own.inertia * rotation.transpose();
        close(&moved, own.volume, rotation * own.centre + shift, inertia, 1e-12);
        let hull = piece.core();
        let sharp = MassProperties::from_piece(&Piece::hull(&points, 0.0).unwrap()).volume;
        let area: f64 = hull.faces().iter().map(|face| face.area).sum();
        let bend: f64 = hull.edges().iter().map(|edge| {
            let [a, b] = edge.vertices.map(|vertex| hull.vertices()[vertex as usize]);
            let [m, n] = edge.faces.unwrap().map(|face| hull.faces()[face as usize].normal);
            (a - b).norm() * m.angle(&n) / 2.0
        }).sum();
        let steiner = sharp + area * r + bend * r * r + 4.0 / 3.0 * PI * r.powi(3);
        prop_assert!((own.volume / steiner - 1.0).abs() < 1e-12);
    }
}

/// Checks that a tiny cube rounded by 1 is a ball, to the size of the cube. The parts of a rounded
/// shape must not depend on how the sphere is divided.
#[test]
fn a_tiny_cube_rounded_is_almost_a_ball() {
    let corners = Piece::cuboid(V::repeat(1e-6)).unwrap().core().vertices().to_vec();
    let given = MassProperties::from_piece(&Piece::hull(&corners, 1.0).unwrap());
    let volume = 4.0 / 3.0 * PI;
    close(&given, volume, V::zeros(), Matrix3::identity() * (0.4 * volume), 1e-5);
}

const CUBE_OBJ: &str = "\
# a cube of side 2
o cube
v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1
f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8
";

#[test]
fn an_obj_cube_is_a_box() {
    let mesh = parse_obj(CUBE_OBJ).unwrap();
    assert_eq!((mesh.vertices().len(), mesh.triangles().len()), (8, 12));
    assert_eq!(mesh.volume(), 8.0);
    let hull = mesh.hull().unwrap();
    assert_eq!((hull.vertices().len(), hull.faces().len()), (8, 6));
    assert_eq!(mesh.scaled(0.5).unwrap().volume(), 1.0);
    // Corners by position, texture and normal, with indices that count from the end.
    let mixed = CUBE_OBJ.replace("f 4 3 2 1", "vt 0 0\nvn 0 0 1\nf -5/1/1 -6/1/1 -7/1/1 -8/1/1");
    assert_eq!(parse_obj(&mixed).unwrap().volume(), 8.0);
}

#[test]
fn invalid_meshes_are_rejected_with_their_edge_or_facet() {
    let refused = |text: &str| match parse_obj(text).and_then(|mesh| mesh.hull()) {
        Ok(_) => "taken".to_owned(),
        Err(error) => error.to_string(),
    };
    let open = refused(&CUBE_OBJ.replace("f 5 6 7 8\n", ""));
    assert!(open.contains("is open: only facet") && open.contains("(-1, -1, 1)"), "{open}");
    let turned = refused(&CUBE_OBJ.replace("f 5 6 7 8", "f 8 7 6 5"));
    assert!(turned.contains("in the same direction in facets"), "{turned}");
    let mut inside_out = String::new();
    for line in CUBE_OBJ.lines() {
        let mut words: Vec<&str> = line.split(' ').collect();
        if words[0] == "f" {
            words[1..].reverse();
        }
        inside_out += &(words.join(" ") + "\n");
    }
    assert!(refused(&inside_out).contains("inside-out"), "{}", refused(&inside_out));
    let dent = CUBE_OBJ.replace("f 5 6 7 8", "v 0 0 0.5\nf 5 6 9\nf 6 7 9\nf 7 8 9\nf 8 5 9");
    let message = refused(&dent);
    assert!(message.contains("not convex") && message.contains("convex pieces"), "{message}");
    assert!(message.contains("(0, 0, 0.5)"), "{message}");
    // Two separate cubes: every vertex is on the hull, but the gap between them is not part of the
    // mesh.
    let second: String = CUBE_OBJ
        .lines()
        .filter(|line| line.starts_with('v'))
        .map(|line| {
            let p: Vec<f64> = line[2..].split(' ').map(|x| x.parse().unwrap()).collect();
            format!("v {} {} {}\n", p[0] + 5.0, p[1], p[2])
        })
        .collect();
    let faces: String = CUBE_OBJ
        .lines()
        .filter(|line| line.starts_with('f'))
        .map(|line| {
            let corners = line[2..].split(' ').map(|x| (x.parse::<i32>().unwrap() + 8).to_string());
            format!("f {}\n", corners.collect::<Vec<_>>().join(" "))
        })
        .collect();
    let message = refused(&format!("{CUBE_OBJ}{second}{faces}"));
    assert!(message.contains("not convex: its volume is 1.6"), "{message}");
    assert!(refused("v 1 2\nf 1 2 3").contains("is not an OBJ file"));
    assert!(refused("").contains("triangles of the mesh: 0 given"));
    assert!(refused("f 1 2 3").starts_with("the mesh "), "{}", refused("f 1 2 3"));
    let degenerate = Mesh::new(vec![V::zeros(); 3], vec![[0, 1, 1]; 4]).unwrap_err();
    assert!(degenerate.to_string().contains("same vertex twice in facet 1"));
    assert!(Mesh::new(vec![V::zeros(); 3], vec![[0, 1, 7]; 4]).is_err());
}

/// Facets of the OBJ cube as STL, rotated so that its corners are rounded to 24 bits.
fn stl_facets() -> Vec<[[f32; 3]; 3]> {
    let mesh = parse_obj(CUBE_OBJ).unwrap();
    let rotation = turn(v(0.4, 0.2, -0.9));
    let corner = |&vertex: &usize| {
        let p = rotation * mesh.vertices()[vertex];
        [p.x as f32, p.y as f32, p.z as f32]
    };
    mesh.triangles().iter().map(|[a, b, c]| [corner(a), corner(b), corner(c)]).collect()
}

fn binary_stl(header: &[u8]) -> Vec<u8> {
    let facets = stl_facets();
    let mut bytes = header.to_vec();
    bytes.resize(80, b' ');
    bytes.extend((facets.len() as u32).to_le_bytes());
    for facet in facets {
        bytes.extend([0; 12]);
        bytes.extend(facet.iter().flatten().flat_map(|x| x.to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

#[test]
fn stl_cubes_are_boxes_whether_binary_or_ascii() {
    let mut ascii = String::from("solid\n");
    for facet in stl_facets() {
        ascii += "facet normal 0 0 0\n  outer loop\n";
        for [x, y, z] in facet {
            ascii += &format!("    vertex {x} {y} {z}\n");
        }
        ascii += "  endloop\nendfacet\n";
    }
    ascii += "endsolid\n";
    let files =
        [binary_stl(b"some program"), binary_stl(b"solid cube"), ascii.clone().into_bytes()];
    for bytes in &files {
        let mesh = parse_stl(bytes).unwrap();
        let hull = mesh.hull().unwrap();
        assert_eq!((hull.vertices().len(), hull.faces().len()), (8, 6));
        // Coordinates of 24 bits: an error of 6e-8 each.
        assert!((mesh.volume() - 8.0).abs() < 1e-5);
        assert!(Piece::mesh(&mesh, 0.1).is_ok());
    }
    let refused = |bytes: &[u8]| parse_stl(bytes).unwrap_err().to_string();
    assert!(refused(b"").contains("is not an STL file"));
    assert!(refused(&files[0][..300]).contains("is not an STL file"));
    assert!(refused(ascii.replace("vertex", "vortex").as_bytes()).contains("is not an STL file"));
    assert!(refused(&ascii.as_bytes()[..500]).contains("is not an STL file"));
    let mut nan = files[0].clone();
    nan[96..100].copy_from_slice(&f32::NAN.to_le_bytes());
    assert!(refused(&nan).contains("coordinate of the mesh (m) is NaN"), "{}", refused(&nan));
}

/// Moments of cylinders, cones and ellipsoids are those of the hulls of many points on them. A disc
/// of n corners has the area π r² (1 − 2 π²/(3 n²)), and the ellipsoid's hull twice that defect.
#[test]
fn smooth_shapes_have_the_moments_of_fine_hulls() {
    let count = 40;
    let defect = 2.0 * PI * PI / (3.0 * (count * count) as f64);
    let pieces = [
        Piece::cylinder(0.3, 0.2, 12).unwrap(),
        Piece::cone(0.3, 0.2, 12).unwrap(),
        Piece::ellipsoid(v(0.3, 0.2, 0.1), 12).unwrap(),
    ];
    let place = (turn(v(0.3, -0.8, 0.5)), v(0.4, 0.1, -0.7));
    for piece in pieces {
        let placed = piece.moved_by(&place.0, &place.1).unwrap();
        let fine = Piece::hull(&placed.smooth().unwrap().samples(count), 0.0).unwrap();
        let (own, fine) = (MassProperties::from_piece(&placed), MassProperties::from_piece(&fine));
        let ratio = fine.volume / own.volume;
        assert!((1.0 - 4.0 * defect..1.0).contains(&ratio), "{ratio}");
        assert!((own.centre - fine.centre).norm() < 4.0 * defect * 0.3);
        assert!((own.inertia - fine.inertia).amax() < 8.0 * defect * own.inertia.amax());
    }
}

/// The extent of a smooth shape along any direction is that of its densest samples, and the core is
/// inside.
#[test]
fn smooth_shapes_contain_their_cores() {
    let pieces = [
        Piece::cylinder(0.3, 0.2, 7).unwrap(),
        Piece::cone(0.3, 0.2, 7).unwrap(),
        Piece::ellipsoid(v(0.3, 0.2, 0.1), 9).unwrap(),
    ];
    for piece in pieces {
        let smooth = *piece.smooth().unwrap();
        let samples = smooth.samples(400);
        for number in 0..200 {
            let height = 1.0 - (2.0 * f64::from(number) + 1.0) / 200.0;
            let (sine, cosine) = (2.4 * f64::from(number)).sin_cos();
            let across = (1.0 - height * height).sqrt();
            let n = v(across * cosine, across * sine, height);
            let of_ellipsoids =
                smooth.ellipsoids().iter().map(|e| n.dot(&e.centre) + e.half_width(&n));
            let apex = piece.core().vertices().iter().map(|corner| n.dot(corner) + piece.radius());
            let core = apex.fold(f64::NEG_INFINITY, f64::max);
            let whole = of_ellipsoids.fold(core, f64::max);
            let dense = samples.iter().map(|x| n.dot(x)).fold(f64::NEG_INFINITY, f64::max);
            assert!(core <= whole + 1e-12 && dense <= whole + 1e-12);
            assert!(whole - dense < 1e-4, "{whole} {dense}");
        }
    }
}
