"""Contact problems: closed forms, files and refusals."""

import importlib.util
import pickle
import sys

import numpy as np
import pytest
import tumble
import tumble.referee


def slide(**more):
    return tumble.ContactProblem(W=np.eye(3) / 2, q=[-1.0, 3.0, 0.0], mu=[0.5], **more)


class Entries:
    """Sparse matrix with the interface of scipy's."""

    def __init__(self, shape, row, col, data):
        self.shape, self.row, self.col, self.data = shape, np.array(row), np.array(col), np.array(data)

    def tocoo(self):
        return self


def falling_plate():
    """Two corners of a falling plate: M, H, f, w."""
    H = np.zeros((6, 6))
    for contact, x in enumerate((1.0, -1.0)):
        frame = np.array([[0, 1, 0], [0, 0, 1], [1, 0, 0]], float)
        arm = np.array([[0, 0.1, 0], [-0.1, 0, -x], [0, x, 0]])
        H[:3, 3 * contact : 3 * contact + 3] = frame
        H[3:, 3 * contact : 3 * contact + 3] = arm @ frame
    return {"M": np.diag([4.0, 4, 4, 1, 2, 3]), "H": H, "f": [8.0, 0, -4, 0, 0, 0], "w": np.zeros(6)}


def missed(problem, solution):
    """Violation of the contact law from the matrices: gaps, normal impulses, cones and friction
    power."""
    p, mu = solution.impulses.reshape(-1, 3), problem.mu
    if problem.is_local:
        u = problem.matrix("W") @ solution.impulses + problem.vector("q")
    else:
        H = problem.matrix("H")
        v = np.linalg.solve(problem.matrix("M"), H @ solution.impulses + problem.vector("f"))
        u = H.T @ v + problem.vector("w")
        assert np.allclose(v, solution.body_velocities, atol=1e-12)
    assert np.allclose(u, solution.velocities, atol=1e-12)
    u = u.reshape(-1, 3)
    along, slip = p[:, 1:], u[:, 1:]
    lengths, speeds = np.linalg.norm(along, axis=1), np.linalg.norm(slip, axis=1)
    power = np.abs(np.einsum("ij,ij->i", along, slip) + mu * p[:, 0] * speeds)
    parts = [-p[:, 0], -u[:, 0], np.minimum(p[:, 0], u[:, 0]), lengths - mu * p[:, 0], power]
    return max(part.max() for part in parts)


def test_a_slide_has_its_closed_form():
    solution = slide().solve()
    assert solution.solved and solution.residual < 1e-12 and solution.parts == 1
    assert np.allclose(solution.impulses, [2, -1, 0], atol=1e-12)
    assert np.allclose(solution.velocities, [0, 2.5, 0], atol=1e-12)
    u, v, residual, error = slide().evaluate(solution.impulses)
    assert np.array_equal(u, solution.velocities) and v.size == 0
    assert residual == solution.residual and error == solution.relative_error
    assert slide().evaluate([0, 0, 0])[2] == 1.0


def test_both_forms_and_both_kinds_of_matrices_agree():
    sparse = pytest.importorskip("scipy.sparse")
    given = falling_plate()
    problem = tumble.ContactProblem(**given, mu=[0.3, 0.6])
    solution = problem.solve()
    assert solution.solved and missed(problem, solution) < 1e-9
    same = {**given, "M": sparse.csc_matrix(given["M"]), "H": sparse.csr_matrix(given["H"])}
    same = tumble.ContactProblem(**same, mu=[0.3, 0.6]).solve()
    assert np.array_equal(same.impulses, solution.impulses)
    local = problem.to_local()
    W = given["H"].T @ np.linalg.solve(given["M"], given["H"])
    assert local.is_local and np.allclose(local.matrix("W"), W, atol=1e-14)
    found = local.solve(rule="compliance", start=solution.impulses)
    assert found.solved and missed(local, found) < 1e-9
    assert repr(problem) == "<tumble.ContactProblem: global, 2 groups, 6 rows>"


def test_the_problems_of_random_bodies_are_solved():
    rng = np.random.default_rng(5)
    solved = 0
    for _ in range(30):
        bodies, contacts = rng.integers(1, 6), rng.integers(1, 16)
        J = rng.normal(size=(3 * contacts, 6 * bodies))
        W, mu = J @ J.T, rng.uniform(0, 0.4, contacts)
        # q is in the range of the impulses, like for bodies that start separated and at rest.
        q = J @ rng.normal(size=6 * bodies)
        q[::3] += np.abs(q[::3]).max()
        problem = tumble.ContactProblem(W=W, q=q - 0.5 * np.abs(q).max(), mu=mu)
        solution = problem.solve()
        if solution.solved:
            assert missed(problem, solution) < 1e-6 * np.abs(W).max()
            solved += 1
    # All 30 are solved. Seeds 5 to 14 solve 28 to 30 each, all but one or two bodies with many
    # contacts.
    assert solved >= 29


def test_text_and_hdf5_keep_a_problem(tmp_path):
    pytest.importorskip("h5py")
    given = falling_plate()
    problem = tumble.ContactProblem(**given, mu=[0.3, 0.6])
    solution = problem.solve()
    problem.write(tmp_path / "a.dat")
    problem.write(tmp_path / "a.hdf5", solution)
    slide().write(tmp_path / "b.dat")
    slide().write(tmp_path / "b.h5")
    for name in ("a.dat", "a.hdf5"):
        again = tumble.ContactProblem.read(tmp_path / name)
        for key, value in given.items():
            same = again.matrix(key) if key in "MH" else again.vector(key)
            assert np.array_equal(same, value), (name, key)
        assert np.array_equal(again.mu, [0.3, 0.6])
        assert np.array_equal(again.solve().impulses, solution.impulses)
    for name in ("b.dat", "b.h5"):
        assert np.allclose(tumble.ContactProblem.read(tmp_path / name).solve().impulses, [2, -1, 0])
    assert sorted(file.name for file in tmp_path.iterdir()) == ["a.dat", "a.hdf5", "b.dat", "b.h5"]


def test_fclib_has_columns_rows_and_equations(tmp_path):
    h5py = pytest.importorskip("h5py")
    sparse = pytest.importorskip("scipy.sparse")
    given = falling_plate()
    for kind, form in ((-1, "csc"), (-2, "csr")):
        path = tmp_path / f"{form}.hdf5"
        with h5py.File(path, "w") as file:
            group = file.create_group("fclib_global")
            group["spacedim"] = np.array([3], np.int32)
            # Equation that fixes v_y.
            held = np.zeros((6, 1))
            held[1] = 1
            for name, dense in (("M", given["M"]), ("H", given["H"]), ("G", held)):
                matrix = getattr(sparse.csc_matrix(dense), "to" + form)()
                own = group.create_group(name)
                own["m"], own["n"] = ([size] for size in dense.shape)
                own["nz"], own["nzmax"] = [kind], [matrix.nnz]
                own["p"], own["i"], own["x"] = matrix.indptr, matrix.indices, matrix.data
            vectors = {"f": given["f"], "w": given["w"], "b": [0.25], "mu": [0.3, 0.6]}
            for name, values in vectors.items():
                group[f"vectors/{name}"] = np.asarray(values, float)
        problem = tumble.ContactProblem.read(path)
        assert problem.sizes == [3, 3, 1] and np.isnan(problem.mu[2])
        solution = problem.solve()
        assert solution.solved
        assert abs(solution.body_velocities[1] + 0.25) < 1e-12


def test_rows_of_joints():
    problem = tumble.ContactProblem(
        W=np.diag([0.5, 0.5, 0.25]), q=[3.0, -1.0, 2.0], laws=[[("box", -1, 1), "limit"], ["locked"]]
    )
    assert np.allclose(problem.solve().impulses, [-1, 2, -8])
    assert np.isnan(problem.mu).all() and problem.sizes == [2, 1]


def test_moments_of_contacts():
    # The limits are 0.2 and 0.1 of a normal impulse of 2.
    laws = [0.5, ("moment", 0, 0.2, 0.1)]
    problem = tumble.ContactProblem(W=np.eye(6), q=[-2.0, 0.3, 0.0, 0.3, 0.4, -0.15], laws=laws)
    solution = problem.solve()
    np.testing.assert_allclose(solution.impulses, [2.0, -0.3, 0.0, -0.24, -0.32, 0.15], atol=1e-9)
    assert problem.sizes == [3, 3] and problem.mu[0] == 0.5 and np.isnan(problem.mu[1])
    again = pickle.loads(pickle.dumps(problem))
    assert np.array_equal(again.solve().impulses, solution.impulses)
    with pytest.raises(tumble.TumbleError, match="group 1 is not such a contact"):
        problem.write("moment.dat")


def test_moments_are_judged_alike_by_the_referee():
    rng = np.random.default_rng(3)
    for _ in range(100):
        by = rng.normal(size=(12, 12))
        inverse = np.linalg.inv(by @ by.T + 0.1 * np.eye(12))
        mass = 0.5 * (inverse + inverse.T)
        laws = [0.6, 0.3, ("moment", 0, *rng.uniform(0, 0.5, 2)), ("moment", 1, *rng.uniform(0, 0.5, 2))]
        before = rng.normal(size=12)
        problem = tumble.ContactProblem(M=mass, H=np.eye(12), f=mass @ before, w=np.zeros(12), laws=laws)
        solution = problem.solve()
        assert solution.solved
        for impulses, exact in ((solution.impulses, True), (solution.impulses + 0.01 * rng.normal(size=12), False)):
            u, after, residual, _ = problem.evaluate(impulses)
            certificate = tumble.referee.certify(
                M=mass,
                J=np.eye(12),
                velocity_before=before,
                velocity_after=after,
                force=np.zeros(12),
                impulses=impulses,
                laws=laws,
                time_step=0.01,
            )
            assert [row.kind for row in certificate.rows] == ["contact", "contact", "moment", "moment"]
            judged = max(row.residual for row in certificate.rows)
            assert abs(judged - residual) < 1e-9 + 1e-6 * judged
            assert (judged < 1e-8) == exact
        exact = certificate.measured().exact()
        assert exact.solved and exact.residual < 1e-9


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"q": [0.0] * 3, "mu": [0.5]}, "W and q, or M, H, f and w"),
        ({"W": np.eye(3), "q": [0.0] * 3}, "mu or laws"),
        ({"W": np.eye(3), "q": [0.0] * 3, "mu": [-0.5]}, "friction"),
        ({"W": np.eye(3), "q": [0.0] * 2, "mu": [0.5]}, "q: 2 given; 3 are needed"),
        ({"W": np.eye(3), "q": [0.0, np.nan, 0.0], "mu": [0.5]}, r"q\[1\] is nan"),
        ({"W": np.triu(np.ones((3, 3))), "q": [0.0] * 3, "mu": [0.5]}, "symmetric"),
        ({"W": -np.eye(3), "q": [0.0] * 3, "mu": [0.5]}, "semidefinite"),
        ({"W": np.eye(3), "q": [0.0] * 3, "mu": [0.5], "dimension": 4}, "dimension"),
        ({"W": np.eye(3), "q": [0.0] * 3, "laws": [["free", "held", "free"]]}, "held"),
        ({"W": np.eye(3), "q": [0.0] * 3, "laws": [["box"] * 3]}, "bounds"),
        ({"W": np.eye(3), "q": [0.0] * 3, "laws": 5}, "laws is 5; a list"),
        ({"W": np.eye(3), "q": [0.0] * 3, "laws": [None]}, "a list is needed"),
        ({"W": np.eye(3), "q": [0.0] * 3, "laws": ["locked"]}, "'locked' is not a group"),
        ({"W": np.eye(1), "q": [0.0], "laws": [[("box", "a", 1)]]}, "a bound of a box is 'a'"),
        ({"W": np.eye(3), "q": [0.0] * 3, "laws": [("moment", 0, 0.1, 0.1)]}, "a moment of group 0; an earlier contact"),
        ({"W": np.eye(6), "q": [0.0] * 6, "laws": [0.5, ("moment", 0, 0.1)]}, "is not a moment"),
        ({"W": np.eye(6), "q": [0.0] * 6, "laws": [0.5, ["rolling"] * 3]}, "'rolling' is no law of a row"),
        ({"W": np.eye(6), "q": [0.0] * 6, "laws": [0.5, ("moment", 0, -0.1, 0.1)]}, "rolling resistance is -0.1"),
        ({"W": np.eye(2), "q": [0.0] * 2, "mu": [0.5], "dimension": 2.0}, "dimension is 2.0"),
        ({"W": np.eye(3) * 1e-170, "q": [-1.0, 0, 0], "mu": [0.5]}, "largest entry of W is 1e-170"),
        ({"W": Entries((-1, 3), [0], [0], [1.0]), "q": [0.0] * 3, "mu": [0.5]}, "W: a size of its shape is -1"),
        ({"W": Entries((3, 2**62), [0], [0], [1.0]), "q": [0.0] * 3, "mu": [0.5]}, "3 x 3 is needed"),
        ({"W": Entries((3, 3), [0.5], [0], [1.0]), "q": [0.0] * 3, "mu": [0.5]}, "a row and a column, whole numbers"),
        ({"W": Entries((3, 3), [0], [-1], [1.0]), "q": [0.0] * 3, "mu": [0.5]}, "an entry is at -1"),
        ({"W": Entries((3, 3), [0, 0], [0, 0], [1.7e308] * 2), "q": [0.0] * 3, "mu": [0.5]}, "inf"),
    ],
)
def test_what_cannot_be_posed_is_refused(given, words):
    with pytest.raises(tumble.TumbleError, match=words):
        tumble.ContactProblem(**given)


def test_what_is_no_file_of_a_problem_is_refused(tmp_path, monkeypatch):
    path = tmp_path / "a.dat"
    path.write_text("3\n1\n7\n3\n3\n")
    with pytest.raises(tumble.TumbleError, match="line 3"):
        tumble.ContactProblem.read(path)
    with pytest.raises(tumble.TumbleError, match="cannot be read"):
        tumble.ContactProblem.read(tmp_path / "none.dat")
    for given, words in [
        ({"rule": "best"}, "rule"),
        ({"rule": 5}, "rule is 5"),
        ({"residual": "x"}, "residual is 'x'"),
    ]:
        with pytest.raises(tumble.TumbleError, match=words):
            slide().solve(**given)
    with pytest.raises(tumble.TumbleError, match="start"):
        slide().solve(start=[0.0])
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(tumble.TumbleError, match="pip install h5py"):
        slide().write(tmp_path / "a.hdf5")
    assert [file.name for file in tmp_path.iterdir()] == ["a.dat"]


def test_the_text_of_siconos_is_read_and_solved(tmp_path):
    path = tmp_path / "a.dat"
    # The problem of slide(), with a dense matrix.
    slides = "3\n1\n0\n3\n3\n3 3\n0.5 0 0\n0 0.5 0\n0 0 0.5\n-1 3 0\n0.5\n"
    path.write_text(slides)
    solution = tumble.ContactProblem.read(path).solve()
    assert solution.solved and np.allclose(solution.impulses, [2, -1, 0], atol=1e-12)
    # No response to a closing velocity of 1 m/s: there is no solution.
    path.write_text("3\n1\n1\n3\n3\n0\n-1 0 0\n0.5\n")
    stuck = tumble.ContactProblem.read(path).solve()
    assert not stuck.solved and stuck.residual == 1.0
    for text, words in [
        ("3\n1\n0\n3\n3\n3 3\n1 0 0", "dense matrix"),
        (slides.replace("-1 3 0", "-1 x 0"), 'line 10.*"x"'),
        (slides.replace("\n0.5\n", "\n-0.5\n"), "friction.*-0.5"),
        (slides.replace("0.5 0 0\n", "0.5 0.4 0\n"), "symmetric"),
    ]:
        path.write_text(text)
        with pytest.raises(tumble.TumbleError, match=f"a.dat: .*{words}"):
            tumble.ContactProblem.read(path)


def test_numbers_of_numpy_are_coefficients():
    for law, mu in [(np.float32(0.5), 0.5), (np.int64(1), 1.0)]:
        assert tumble.ContactProblem(W=np.eye(3), q=[-1.0, 0, 0], laws=[law]).mu == [mu]


def test_the_empty_problem_is_kept(tmp_path):
    empty = tumble.ContactProblem(W=np.zeros((0, 0)), q=[], mu=[])
    paths = [tmp_path / "none.dat"]
    if importlib.util.find_spec("h5py"):
        paths.append(tmp_path / "none.hdf5")
    for path in paths:
        empty.write(path)
        again = tumble.ContactProblem.read(path)
        assert again.sizes == [] and again.solve().solved
    rows = tumble.ContactProblem(W=np.eye(1), q=[0.0], laws=[["locked"]])
    with pytest.raises(tumble.TumbleError, match="rows.dat: .*group 0"):
        rows.write(tmp_path / "rows.dat")


def test_a_solution_of_another_problem_is_refused(tmp_path):
    pytest.importorskip("h5py")
    other = tumble.ContactProblem(W=np.eye(3), q=[-1.0, 3.0, 0.0], mu=[0.5])
    both = tumble.ContactProblem(**falling_plate(), mu=[0.3, 0.6])
    for solution in (other.solve(), both.solve()):
        with pytest.raises(tumble.TumbleError, match="another problem"):
            slide().write(tmp_path / "a.hdf5", solution)
    assert not list(tmp_path.iterdir())
    slide().write(tmp_path / "a.hdf5", slide().solve())


def test_broken_files_of_fclib_are_refused(tmp_path):
    h5py = pytest.importorskip("h5py")
    slide().write(tmp_path / "whole.hdf5")
    path = tmp_path / "broken.hdf5"

    def of(name, value):
        def change(group):
            del group[name]
            group[name] = value

        return change

    one = lambda value: np.array([value])  # noqa: E731
    columns = lambda p: lambda group: (of("W/nz", one(-1))(group), of("W/p", p)(group))  # noqa: E731
    for change, words in [
        (of("W/n", one(2**31 - 1)), "3 x 2147483647"),
        (of("W/n", one(-3)), "3 and -3"),
        (of("W/nz", one(1000)), "nz of a matrix is 1000, but it has 3"),
        (of("W/i", np.full(3, 0.5)), "p and i of a matrix are not whole numbers"),
        (of("W/i", np.array([-1, 1, 2])), "an entry is at -1"),
        (columns(np.array([0, 1, 2])), "does not have the starts of 3 lines"),
        (columns(np.array([0, 2, 1, 3])), "does not have the starts of 3 lines"),
        (columns(np.array([0, 1, 2, 2**40])), "does not have the starts of 3 lines"),
        (of("W", np.eye(3)), ""),
        (of("vectors/mu", np.array([-1.0])), "friction"),
        (of("vectors/q", np.zeros(2)), "q: 2 given"),
        (lambda group: (group["vectors"].__delitem__("q"), group["vectors"].create_group("q")), ""),
        (of("spacedim", one(5)), "dimension is 5"),
    ]:
        path.write_bytes((tmp_path / "whole.hdf5").read_bytes())
        with h5py.File(path, "r+") as file:
            change(file["fclib_local"])
        with pytest.raises(tumble.TumbleError, match=f"broken.hdf5: .*{words}"):
            tumble.ContactProblem.read(path)
    # Other groups next to the vectors are ignored.
    path.write_bytes((tmp_path / "whole.hdf5").read_bytes())
    with h5py.File(path, "r+") as file:
        file["fclib_local/vectors"].create_group("more")
    assert tumble.ContactProblem.read(path).solve().solved


def test_problems_are_pickled():
    q = np.array([-1.0, 0.3, 0.1, -0.2])
    laws = [0.4, [("box", -0.1, 0.2)]]
    local = tumble.ContactProblem(W=np.eye(4), q=q, laws=laws)
    form = tumble.ContactProblem(M=2.0 * np.eye(4), H=np.eye(4), f=np.zeros(4), w=q, laws=laws)
    q[:] = 7.0
    for problem in (local, form, form.to_local()):
        other = pickle.loads(pickle.dumps(problem))
        assert other.is_local == problem.is_local and other.sizes == [3, 1]
        np.testing.assert_array_equal(other.solve().impulses, problem.solve().impulses)
        assert problem.solve().impulses[0] > 0.9
