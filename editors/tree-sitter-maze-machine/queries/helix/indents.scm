[
  (state)
  (parallel)
  (member)
  (arguments)
  (group)
] @indent

")" @outdent
