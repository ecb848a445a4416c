//! The problems, a file for each kind of motion.

mod arch;
mod blocks;
mod bouncing;
mod bricard;
mod chain;
mod collision;
mod crank;
mod dominoes;
mod door;
mod dragging;
mod falling;
mod grid;
mod heap;
mod leaning;
mod pair;
mod pendulum;
mod rocking;
mod rolling;
mod sliding;
mod slope;
mod spinning;
mod squeezer;
mod stack;
mod stewart;
mod toppling;
mod tumbling;
mod turntable;
mod windows;

use crate::TestProblem;

/// All problems, simple ones first.
pub static PROBLEMS: [TestProblem; 43] = [
    falling::FREE_FALL,
    sliding::SLIDING_STOP,
    slope::STICK,
    slope::SLIDE,
    sliding::FAST_PLATE,
    spinning::SPINNING_BOX,
    sliding::COMPASS,
    dragging::DRAGGED_CUBE,
    rocking::ROCKING,
    toppling::PUSHED_OVER,
    toppling::SLOPE_TOPPLE,
    tumbling::TUMBLE,
    bouncing::BOUNCING_BOX,
    bouncing::EDGE_IMPACT,
    rolling::ROLLING_BALL,
    rolling::SLIDING_BALL,
    leaning::LADDER,
    stack::STACK,
    stack::MASS_RATIO,
    collision::COLLISION,
    collision::BALL_CHAIN,
    collision::CRADLE,
    bouncing::BOUNCING_BALLS,
    pair::PAIR_IN_FLIGHT,
    blocks::BLOCKS_ON_SLOPE,
    blocks::PULLED_BLOCK,
    leaning::CARD_TENT,
    turntable::TURNTABLE,
    arch::ARCH,
    dominoes::DOMINOES,
    grid::BALL_GRID,
    heap::BALLS_666,
    heap::ELASTIC_666,
    pendulum::PENDULUM,
    pendulum::STIFF_HINGE,
    pendulum::SERVO,
    crank::SLIDER_CRANK,
    chain::FREE_CHAIN,
    door::DOOR,
    windows::FOUR_BAR_WINDOWS,
    bricard::BRICARD,
    squeezer::SQUEEZER,
    stewart::STEWART,
];
