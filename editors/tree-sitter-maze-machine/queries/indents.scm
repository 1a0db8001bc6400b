(block) @indent.begin
[
  (state)
  (parallel)
] @indent.begin
(arguments) @indent.begin
(group) @indent.begin
")" @indent.branch
