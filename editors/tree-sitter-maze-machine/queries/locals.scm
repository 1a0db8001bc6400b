(file) @local.scope

(parameter name: (name) @local.definition.constant)
(variable name: (name) @local.definition.var)
(event name: (name) @local.definition.enum)
(enumeration name: (name) @local.definition.type)
(definition name: (name) @local.definition.function)
(import name: (name) @local.definition.import)
(state name: (name) @local.definition.type)
(parallel name: (name) @local.definition.type)
(member name: (name) @local.definition.type)
(final name: (name) @local.definition.type)

(name) @local.reference
