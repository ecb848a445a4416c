//! Random assemblies: statics against the simulator.
