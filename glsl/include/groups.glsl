// One row of work groups is too short for millions of particles: they are dispatched as rectangles.
uint group_index() { return gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x; }
uint invocation() { return group_index() * PARTICLE_GROUP + gl_LocalInvocationIndex; }
