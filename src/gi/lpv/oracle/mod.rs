//! Plain twins of the passes, in double precision.
