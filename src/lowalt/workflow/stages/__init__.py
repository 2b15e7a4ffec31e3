"""What the rules of each stage take, one module a stage, named after the rule file of the stage."""
