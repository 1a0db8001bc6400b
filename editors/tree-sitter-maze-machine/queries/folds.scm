[
  (state)
  (parallel)
  (member)
  (comment)+
] @fold
