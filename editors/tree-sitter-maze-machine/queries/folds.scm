[
  (state)
  (parallel)
  (comment)+
] @fold
