"""Arguments of scripts/bench.

The module only needs Python, so that a wrong argument ends the script before anything is
installed. As a program it prints the engines that will run.
"""

import argparse
from pathlib import Path

ENGINES = ("tutorial", "tumble", "mujoco", "drake", "rapier", "pybullet", "dart")
# One box; several boxes; 1 to 1000 boxes; first steps of structures; settling heaps; contact
# problems of steps for other solvers; contact problems of a folder.
SCENES = ("one", "several", "growth", "first", "heaps", "local", "bare")


class Parser(argparse.ArgumentParser):
    """Parser that reports an error in one sentence."""

    def error(self, message: str) -> None:
        self.exit(2, f"bench: {message}\n")


def seeds(text: str) -> list[int]:
    """Parses distinct whole numbers from 0 to 2³² − 1, separated by commas."""
    parts = text.split(",")
    found = [int(part) for part in parts if part.isdecimal() and int(part) < 2**32]
    if len(found) != len(parts) or len(set(found)) != len(found):
        needed = "needed are different whole numbers from 0 to 4294967295 between commas"
        raise argparse.ArgumentTypeError(f"'{text}': {needed}")
    return found


def rounds(text: str) -> int:
    if not text.isdecimal() or not 1 <= int(text) <= 1000:
        raise argparse.ArgumentTypeError(f"'{text}': a whole number from 1 to 1000 is needed")
    return int(text)


def boxes(text: str) -> int:
    if not text.isdecimal() or not 1 <= int(text) <= 2000:
        raise argparse.ArgumentTypeError(f"'{text}': a whole number from 1 to 2000 is needed")
    return int(text)


def some_of(known: tuple[str, ...]):
    """Type of an argument of names separated by commas, returned in the order of `known`."""

    def names(text: str) -> list[str]:
        given = text.split(",")
        for name in given:
            if name not in known:
                raise argparse.ArgumentTypeError(f"'{name}': there are {', '.join(known)}")
        return [name for name in known if name in given]

    return names


def parse() -> argparse.Namespace:
    """Parses the arguments of the program."""
    parser = Parser(
        prog="scripts/bench",
        description="tumble and other engines on the same scenes, interleaved, on this machine.",
        allow_abbrev=False,
    )
    parser.add_argument(
        "--seeds", type=seeds, default=[42, 0], help="of the drop scene [default: 42,0]"
    )
    parser.add_argument(
        "--scenes",
        type=some_of(SCENES),
        help="which to run [default: all, bare with --problems alone]",
    )
    parser.add_argument(
        "--heap-seeds", type=seeds, default=[1, 2, 3], help="of the heaps [default: 1,2,3]"
    )
    parser.add_argument(
        "--heap-boxes", type=boxes, default=100, help="boxes of a heap, 1 to 2000 [default: 100]"
    )
    parser.add_argument(
        "--problems", type=Path, metavar="DIR", help="folder of the bare problems: files in .dat"
    )
    parser.add_argument("--rounds", type=rounds, default=3, help="of timing [default: 3]")
    parser.add_argument(
        "--engines",
        type=some_of(ENGINES),
        default=list(ENGINES),
        help=f"which to run [default: {','.join(ENGINES)}]",
    )
    parser.add_argument(
        "--out",
        type=Path,
        default=Path("target/bench"),
        help="directory for results.json, results.md and rounds.jsonl [default: target/bench]",
    )
    chosen = parser.parse_args()
    given = chosen.problems is not None
    if chosen.scenes is None:
        chosen.scenes = [name for name in SCENES if name != "bare" or given]
    if given != ("bare" in chosen.scenes):
        parser.error("--problems names the folder of the scene 'bare': both or none are needed")
    if given and not any(chosen.problems.glob("*.dat")):
        parser.error(f"--problems: {chosen.problems}: no file there ends in .dat")
    return chosen


def needed(chosen: argparse.Namespace) -> list[str]:
    """Names of the components that scripts/bench must install or build."""
    names = [name for name in chosen.engines if name != "tumble"]
    if "tumble" in chosen.engines:
        names += ["tumble"] if "one" in chosen.scenes else []
        several = {"several", "growth", "first", "heaps"}
        names += ["boxes"] if several & set(chosen.scenes) else []
    return names + (["local"] if {"local", "bare"} & set(chosen.scenes) else [])


if __name__ == "__main__":
    print("\n".join(needed(parse())))
