; As ../highlights.scm; but in Helix the first pattern that fits wins, so the general one comes last.

(comment) @comment

["machine" "import"] @keyword.import @keyword.control.import
["param" "adjustable" "var" "event" "enum" "define" "property" "assume" "expose" "state" "member" "parallel" "final"] @keyword.type @keyword.storage
["do" "initial" "entry" "exit" "raise" "send" "cancel" "defer"] @keyword
["on" "when" "if" "else" "after" "every" "for" "within" "before" "stay"] @keyword.conditional @keyword.control.conditional
["never" "always" "eventually"] @keyword
["and" "or" "not"] @keyword.operator

["->" "=>" "==" "!=" "<=" ">=" "<" ">" "+" "-" "*" "=" "+=" "-=" "*="] @operator
(any) @operator
["(" ")"] @punctuation.bracket
["," ":"] @punctuation.delimiter
(actions "/" @punctuation.delimiter)
(product "/" @operator)

((name) @boolean @constant.builtin.boolean
  (#any-of? @boolean "true" "false"))
(number) @number @constant.numeric

(machine name: (name) @module @namespace)
(import name: (name) @module @namespace)
(state name: (name) @type)
(parallel name: (name) @type)
(final name: (name) @type)
(initial name: (name) @type)
(target state: (name) @type)
(parameter name: (name) @constant)
(variable name: (name) @variable)
(enumeration name: (name) @type)
(enumeration value: (name) @constant)
(event name: (name) @label)
(on event: (name) @label)
(defer event: (name) @label)
(raise event: (name) @label)
(send event: (name) @label)
(field name: (name) @variable.parameter)
(member name: (name) @type)
(cancel event: (name) @label)
(definition name: (name) @function)
(property name: (name) @label)
(assumption name: (name) @label)
(type) @type.builtin
(call function: (name) @function.call @function)
(named_argument name: (name) @variable.parameter)

(name) @variable
