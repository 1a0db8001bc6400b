(block) @indent.begin
[
  (state)
  (parallel)
  (member)
] @indent.begin
(arguments) @indent.begin
(group) @indent.begin
")" @indent.branch
