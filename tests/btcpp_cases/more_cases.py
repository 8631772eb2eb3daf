# SPDX-License-Identifier: MIT
"""More cases of BehaviorTree.CPP 4.10 in our words: ports, names, files, scripts. As in cases.py.

Names that begin with `ours` are no case of theirs.
"""

from __future__ import annotations

from btcpp_cases.cases import Case

_TRUE = '<ScriptCondition code="{}"/>'


def _case(theirs: str, nodes: str, *ticks: str, trees: str = "", inputs: str = "") -> Case:
    return Case(theirs, nodes, ticks, trees, inputs)


def _checks(theirs: str, *conditions: str) -> Case:
    """All these scripts are true."""
    escaped = (text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;") for text in conditions)
    return Case(theirs, f"<Sequence>{''.join(map(_TRUE.format, escaped))}</Sequence>", ("-> S",))


def _script(theirs: str, code: str, entries: str, answer: str = "S") -> Case:
    escaped = code.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
    return Case(theirs, f'<Script code="{escaped}"/>', (f"-> {answer} | {entries}",))


PARSER = (
    _checks("ParserTest.ChainedComparisons", "1 < 2 < 3", "3 > 2 > 1", "!(1 < 2 > 3)", "5 == 5 == 5", "5 == 5 != 3",
            "1 <= 2 <= 3", "3 >= 2 >= 1"),
    _checks("ParserTest.OperatorPrecedence (2)", "(6 | 3 & 5) == 7", "true && (6 | 0)", "false || true && true",
            "false && true || true", "(2 + 3) * 4 == 20", "2 * (3 + 4) == 14"),
    _checks("ParserTest.UnaryOperators", "!true == 0", "!false", "!!true", "~0 == -1", "-(3 + 2) == -5", "10 + -3 == 7"),
    _checks("ParserTest.TernaryExpressions (2)", "(true ? 1 : 2) == 1", "(false ? 1 : 2) == 2", "(true ? 2 + 3 : 10) == 5",
            "(false ? 10 : 2 + 3) == 5", "(3 > 2 ? 'yes' : 'no') == 'yes'", "(3 < 2 ? 'yes' : 'no') == 'no'"),
    _script("ParserTest.MultipleStatements", "a:=1;;; b:=2;;", "a=1 b=2"),
    _script("ParserTest.NewLine", "A:=5;&#10;B:=6".replace("&#10;", "\n"), "A=5 B=6"),
    _script("ParserTest.CompareWithNegativeNumber_Issue832", "A:=0; p:=A!=-1; q:=A==-1; r:=A>-1; s:=A<-1", "p=1 q=0 r=1 s=0"),
    _case("ParserTest.CompareWithNegativeNumber_Issue832 (2)",
          '<Sequence><Script code="A:=0"/><AlwaysSuccess _failureIf="A!=-1"/></Sequence>', "-> F"),
    _script("ParserTest.OperatorAssociativity_Issue1029 (2)", "a := 5 - 2 + 1; b := 20 / 2 * 5; c := 2 - 2 - 2", "a=4 b=50 c=-2"),
    _case("ParserTest.Enums_Issue_523",
          '<Sequence><Script code="battery := 9"/><ForceSuccess><Fallback><ScriptCondition code="battery &gt; 10"/>'
          '<T _onSuccess="battery := 10"/></Fallback></ForceSuccess></Sequence>', "-> S : T | battery=10"),
    _case("ParserTest.Issue595",
          "<Sequence><Precondition if=\"my_string == ''\" else=\"FAILURE\"><T/></Precondition></Sequence>",
          "-> S : T", inputs="my_string:std::string"),
    _case("ParserTest.EnumsXML",
          '<Sequence><Script code="my_color := Red; color2 := my_color"/><Script code="my_color == color2 ? '
          'x := 1 : x := x"/></Sequence>'.replace(" : x := x", " : x"), "-> S | x=1"),
)  # fmt: skip

PORTS = (
    _case("PortTypeRules.SameType_IntToInt", '<Sequence><Twice i="21" o="{value}"/><Twice i="{value}" o="{result}"/></Sequence>',
          "-> S | value=42 result=84"),
    _case("PortTypeRules.StringToInt_ViaConvertFromString",
          '<Sequence><SetBlackboard value="42" output_key="value"/><Twice i="{value}" o="{result}"/></Sequence>',
          "-> S | result=84"),
    _case("PortTypeRules.StringToDouble_ViaConvertFromString",
          '<Sequence><SetBlackboard value="3.14" output_key="value"/><Real v="{value}"/></Sequence>', "-> S : Real(3.14)"),
    _case("PortTypeRules.SubtreeStringInput_ToTypedPort", '<SubTree ID="Sub" input="42"/>', "-> S | ",
          trees='<BehaviorTree ID="Sub"><Twice i="{input}" o="{result}"/></BehaviorTree>'),
    _case("PortTypeRules.GenericPort_AcceptsInt", '<Sequence><Twice i="21" o="{value}"/><Any x="{value}"/></Sequence>', "-> S"),
    _case("PortTypeRules.GenericPort_AcceptsString", '<Sequence><Any x="hello"/><Any x="5"/></Sequence>', "-> S"),
    _case("PortTypeRules.BlackboardSetInt_CreatesStronglyTypedEntry",
          '<Sequence><Out o="{n}"/><Script code="n := 7"/><Num v="{n}"/></Sequence>', "-> S : Out Num(7)"),
    _case("PortTypeRules.StringLiteralValidation_ValidFormat", '<Sequence><Num v="-7"/><Real v="1e3"/></Sequence>',
          "-> S : Num(-7) Real(1000)"),
    _case("PortTypeRules.StringToDifferentTypes", '<Sequence><SubTree ID="N" x="5"/><SubTree ID="R" x="5"/></Sequence>',
          "-> S : Num(5) Real(5)",
          trees='<BehaviorTree ID="N"><Num v="{x}"/></BehaviorTree><BehaviorTree ID="R"><Real v="{x}"/></BehaviorTree>'),
    _case("PortTypeRules.GenericToTyped_ChainThroughBlackboard",
          '<Sequence><SetBlackboard value="21" output_key="a"/><SetBlackboard value="{a}" output_key="b"/>'
          '<Twice i="{b}" o="{c}"/></Sequence>', "-> S | c=42"),
    _case("PortTest.DefaultPorts", "<WithDefault/>", "-> S : WithDefault(42)"),
    _case("PortTest.DefaultInput", '<Sequence><WithDefault/><WithDefault v="7"/></Sequence>',
          "-> S : WithDefault(42) WithDefault(7)"),
    _case("PortTest.EmptyPort", '<WithDefault v=""/>', "-> S : WithDefault(42)"),
    _case("PortTest.SubtreeStringLiteralToLoopDouble_Issue1065", '<SubTree ID="L" q="1;2.5"/>',
          "-> R : Real(1)", "-> R : Real(2.5)", "-> S :",
          trees='<BehaviorTree ID="L"><LoopDouble queue="{q}" value="{v}"><Real v="{v}"/></LoopDouble></BehaviorTree>'),
    _case("BlackboardTest.NullOutputRemapping", "<Sequence><Out/><Out o=\"{x}\"/></Sequence>", "-> S : Out Out | x=42"),
    _case("BlackboardTest.SetOutputFromText", '<Sequence><Out o="{my_port}"/><Num v="{my_port}"/></Sequence>',
          "-> S : Out Num(42)"),
    _case("BlackboardTest.GetInputsFromText", '<Num v="11"/>', "-> S : Num(11)"),
    _case("BlackboardTest.SetBlackboard_WithPortRemapping",
          '<Sequence><SetBlackboard output_key="pos" value="0.5"/><Repeat num_cycles="1"><SubTree ID="V" p="{pos}"/></Repeat>'
          "</Sequence>", "-> S : Real(0.5) | pos=22",
          trees='<BehaviorTree ID="V"><Sequence><Real v="{p}"/><SetBlackboard output_key="p" value="22"/></Sequence></BehaviorTree>'),
    _case("Enums.StrintToEnum", '<Sequence><Paint c="Red"/><Paint c="1"/></Sequence>', "-> S : Paint(0) Paint(1)"),
    _case("Enums.SubtreeRemapping", '<SubTree ID="P" c="Blue"/>', "-> S : Paint(1)",
          trees='<BehaviorTree ID="P"><Sequence><ScriptCondition code="c == Blue"/><Paint c="{c}"/></Sequence></BehaviorTree>'),
    _case("LoopNode.DynamicQueueFromBlackboard",
          '<Sequence><Fill o="{q}"/><LoopInt queue="{q}" value="{v}"><Num v="{v}"/></LoopInt></Sequence>',
          "-> R : Fill Num(10)", "-> R : Num(20)", "-> S :"),
    _case("LoopNode.VectorInput_Issue969",
          '<Sequence><Fill o="{q}"/><LoopInt queue="{q}" value="{v}"><T/></LoopInt></Sequence>',
          "-> R : Fill T", "-> R : T", "-> S :"),
)  # fmt: skip

TREES = (
    _case("BehaviorTreeFactory.Subtree",
          '<Fallback><Inverter><P/></Inverter><SubTree ID="Door"/><T/></Fallback>', "-> S : P Q A",
          trees='<BehaviorTree ID="Door"><Sequence><Q/><A/></Sequence></BehaviorTree>'),
    _case("BehaviorTreeFactory.SubTreeWithRemapping",
          "<Sequence><Script code=\"talk_hello := 'hello'\"/><SubTree ID=\"Talk\" hello_msg=\"{talk_hello}\" "
          'bye_msg="{talk_bye}"/><Say text="{talk_bye}"/></Sequence>', "-> S : Say(hello) Say(bye_bye)",
          trees='<BehaviorTree ID="Talk"><Sequence><Say text="{hello_msg}"/><Script code="bye_msg := \'bye bye\'"/>'
          "</Sequence></BehaviorTree>"),
    _case("BehaviorTreeFactory.MalformedXML_ModerateNestingIsOK", "<Inverter>" * 50 + "<T/>" + "</Inverter>" * 50, "-> S : T"),
    _case("SubTree.SubstringTreeIDsAreNotRecursive", '<SubTree ID="Tree_ABC"/>', "-> S : T",
          trees='<BehaviorTree ID="Tree_ABC"><SubTree ID="Tree_AB"/></BehaviorTree><BehaviorTree ID="Tree_AB"><SubTree ID="Tree_A"/>'
          '</BehaviorTree><BehaviorTree ID="Tree_A"><T/></BehaviorTree>'),
    _case("SubTree.UniqueSubTreeNames_WorksCorrectly", '<Sequence><SubTree ID="W" name="a"/><SubTree ID="W" name="b"/></Sequence>',
          "-> S : T T", trees='<BehaviorTree ID="W"><T/></BehaviorTree>'),
    _case("SubTree.NoNameAttribute_AutoGeneratesUniquePaths", '<Sequence><SubTree ID="W"/><SubTree ID="W"/></Sequence>',
          "-> S : T T", trees='<BehaviorTree ID="W"><T/></BehaviorTree>'),
    _case("SubTree.SubtreeModels", '<SubTree ID="MySub" sub_in_value="3"/>', "-> S : Num(3) Say(john)",
          trees='<BehaviorTree ID="MySub"><Sequence><Num v="{sub_in_value}"/><Script code="name := \'john\'"/>'
          '<Say text="{name}"/></Sequence></BehaviorTree>'),
    _case("SubTree.LiteralNumericPortsPreserveType", '<SubTree ID="Lit" a="42" b="3.5"/>', "-> S",
          trees='<BehaviorTree ID="Lit"><ScriptCondition code="a + 1 == 43 &amp;&amp; b * 2 == 7"/></BehaviorTree>'),
    _case("SubTree.Issue653_SetBlackboard",
          '<Sequence><SubTree ID="Init" obj="{x}"/><SubTree ID="Check" obj="{x}"/></Sequence>', "-> S : Num(5) | x=5",
          trees='<BehaviorTree ID="Init"><SetBlackboard value="5" output_key="obj"/></BehaviorTree>'
          '<BehaviorTree ID="Check"><Num v="{obj}"/></BehaviorTree>'),
    _case("NameValidationXMLTest.ValidInstanceName_WithSpace", '<T name="a name with blanks"/>', "-> S : T"),
    _case("NameValidationXMLTest.ValidInstanceName_WithPeriod", '<T name="v1.2"/>', "-> S : T"),
    _case("NameValidationXMLTest.UnicodeInstanceName_Japanese", '<T name="テスト"/>', "-> S : T"),
    _case("NameValidationXMLTest.ValidSubTreePortName", '<SubTree ID="VP" my_port="1"/>', "-> S : Num(1)",
          trees='<BehaviorTree ID="VP"><Num v="{my_port}"/></BehaviorTree>'),
)  # fmt: skip

MORE = (*PARSER, *PORTS, *TREES)

MORE_REFUSED = {
    "ParserTest.TokenizerEdgeCases": ("<Script code=\"x := 'hello\"/>", "a text without its closing '"),
    "ParserTest.TokenizerEdgeCases (2)": ('<Script code="x := 0x"/>', "is neither a number nor a name"),
    "ParserTest.TokenizerEdgeCases (3)": ('<Script code="x := 3e"/>', "is neither a number nor a name"),
    "ParserTest.TokenizerEdgeCases (4)": ('<Script code="   "/>', "needs the attribute code"),
    "ParserTest.ValidateScriptLargeError_Issue923": (f'<Script code="{"+6e66>6666.6+66&lt;6" * 300}"/>', "more than"),
    "PortTypeRules.TypeLock_XMLTreeCreation_TypeMismatch": (
        '<Sequence><Out o="{value}"/><Say text="{value}"/></Sequence>', "but entry 'value' is int32_t"),
    "PortTypeRules.TypeLock_IntToDouble_Fails": (
        '<Sequence><Out o="{value}"/><Real v="{value}"/></Sequence>', "but entry 'value' is int32_t"),
    "PortTypeRules.SafeCast_IntToUint8_Overflow": ('<Byte v="300"/>', "300 is outside uint8_t"),
    "PortTypeRules.SafeCast_IntToUint8_Negative": ('<Byte v="-1"/>', "-1 is outside uint8_t"),
    "PortTest.WrongPort": ('<Num v="1" in_port_="1"/>', "has no attribute 'in_port_'"),
    "PortTest.DefaultWronglyOverriden": ('<WithDefault v="hello"/>', "'hello' is not a whole number"),
    "BlackboardTest.TypoInPortName": ('<Num vv="{x}"/>', "has no attribute 'vv'"),
    "BehaviorTreeFactory.NotRegisteredNode": ("<Sequence><Nobody/></Sequence>", "unknown node 'Nobody'"),
    "BehaviorTreeFactory.MalformedXML_UnknownNodeType": ("<UnknownNodeType/>", "unknown node 'UnknownNodeType'"),
    "BehaviorTreeFactory.MalformedXML_EmptyBehaviorTree": ("", "needs exactly 1 node, and has 0"),
    "BehaviorTreeFactory.MalformedXML_MultipleBTChildElements": ("<T/><T/>", "needs exactly 1 node, and has 2"),
    "SubTree.RecursiveSubtree": ('<SubTree ID="c0"/>', "trees contain each other in a cycle"),
    "SubTree.SubtreeNameNotRegistered": ('<SubTree ID="WrongName"/>', "names no tree: 'WrongName'"),
    "NameValidationXMLTest.InvalidSubTreePortName_WithSpace": ('<SubTree ID="mySubtree" a b="1"/>', "not well-formed"),
    "NameValidationXMLTest.InvalidSubTreePortName_StartsWithDigit": ('<SubTree ID="mySubtree" 1a="1"/>', "not well-formed"),
    "Decorator.RunOnce (no child)": ("<RunOnce/>", "needs exactly 1 child"),
    "ours: twice the same attribute": ('<Num v="1" v="2"/>', "not well-formed XML"),
    "ours: a decorator without a child": ("<Inverter/>", "needs exactly 1 child node(s), and has 0"),
    "ours: an action with a child": ("<T><U/></T>", "is a leaf and cannot have children"),
}  # fmt: skip
